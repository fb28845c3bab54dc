#include "mono_pose_tracker/io/text_file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace mono_pose_tracker {

std::string read_text_file(const std::string& path, const std::string& expected) {
  const auto fail = [&](const std::string& reason) {
    throw std::runtime_error(path + ": cannot be read (" + reason + "): expected " + expected);
  };
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) fail("it is a folder");
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) fail(errno ? std::strerror(errno) : "unknown reason");
  const std::string content{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (stream.bad()) fail("read error");
  return content;
}

}  // namespace mono_pose_tracker
