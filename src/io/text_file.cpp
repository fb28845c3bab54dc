#include "io/text_file.h"

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "common/text.h"
#include "read_whole.h"

namespace mono_pose_tracker {

std::string read_text_file(const std::string& path, const std::string& expected, std::size_t max_bytes) {
  const auto fail = [&](const std::string& reason) {
    throw std::runtime_error(path + ": cannot be read (" + reason + "): expected " + expected);
  };
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) fail("it is a folder");
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) fail(system_error_text());
  std::string content;
  if (!read_whole(stream, max_bytes, &content)) {
    fail("it has more than " + std::to_string(max_bytes) + " bytes");
  }
  if (stream.bad()) fail("read error");
  const char* const mark = "\xef\xbb\xbf";  // of UTF-8, as editors on Windows put it before a text
  if (content.rfind(mark, 0) == 0) content.erase(0, 3);
  return content;
}

}  // namespace mono_pose_tracker
