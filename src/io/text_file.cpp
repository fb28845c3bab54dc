#include "mono_pose_tracker/io/text_file.h"

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <vector>

#include "mono_pose_tracker/common/system_error.h"

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
  std::vector<char> block(64 * 1024);
  do {
    stream.read(block.data(), static_cast<std::streamsize>(block.size()));
    content.append(block.data(), static_cast<std::size_t>(stream.gcount()));
    if (content.size() > max_bytes) fail("it has more than " + std::to_string(max_bytes) + " bytes");
  } while (stream);
  if (stream.bad()) fail("read error");
  const char* const mark = "\xef\xbb\xbf";  // of UTF-8, as editors on Windows put it before a text
  if (content.rfind(mark, 0) == 0) content.erase(0, 3);
  return content;
}

}  // namespace mono_pose_tracker
