#include "mono_pose_tracker/io/atomic_file.h"

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <locale>
#include <stdexcept>

#include "mono_pose_tracker/common/system_error.h"

namespace mono_pose_tracker {

namespace {

/// A device, a pipe or a link (/dev/stdout) is written through: to rename onto it would replace it.
bool is_replaceable(const std::string& path) {
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::symlink_status(path, ignored);
  return !std::filesystem::exists(status) || std::filesystem::is_regular_file(status);
}

}  // namespace

void make_folder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) throw std::runtime_error(path + ": cannot be made (" + error.message() + ")");
}

void require_regular_file(const std::string& path) {
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::status(path, ignored);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    throw std::runtime_error(path + ": cannot be written (it is no regular file)");
  }
}

void write_file_atomically(const std::string& path, const std::function<void(std::ostream&)>& write) {
  const bool replace = is_replaceable(path);
  const std::string written = replace ? path + ".part" : path;
  const auto fail = [&] {
    const std::string reason = system_error_text();
    if (replace) std::remove(written.c_str());
    throw std::runtime_error(path + ": cannot be written (" + reason + ")");
  };
  errno = 0;
  std::ofstream stream(written, std::ios::binary | std::ios::trunc);
  if (!stream) fail();
  stream.imbue(std::locale::classic());
  write(stream);
  stream.close();
  if (!stream || (replace && std::rename(written.c_str(), path.c_str()) != 0)) fail();
}

}  // namespace mono_pose_tracker
