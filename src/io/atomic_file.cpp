#include "io/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <locale>
#include <optional>
#include <stdexcept>

#include "common/text.h"

namespace mono_pose_tracker {

namespace {

std::runtime_error cannot_be_written(const std::string& path, const std::string& reason) {
  return std::runtime_error(path + ": cannot be written (" + reason + ")");
}

// Not made of the path's own name: that may be as long as names can be.
std::string make_part(const std::string& path) {
  static std::atomic<unsigned> count{0};
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  for (;;) {
    std::string name = folder / ("." + std::to_string(getpid()) + "_" + std::to_string(count++) + ".part");
    const int file = open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file >= 0) {
      close(file);
      return name;
    }
    if (errno != EEXIST) throw cannot_be_written(path, system_error_text());
  }
}

/// Devices, pipes and links (/dev/stdout) are written directly: renaming would replace them.
bool is_replaceable(const std::string& path) {
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::symlink_status(path, ignored);
  return !std::filesystem::exists(status) || std::filesystem::is_regular_file(status);
}

}  // namespace

PartFile::PartFile(const std::string& path) : path_(path), name_(make_part(path)) {}

PartFile::~PartFile() {
  if (!name_.empty()) std::remove(name_.c_str());
}

void PartFile::put_in_place() {
  if (std::rename(name_.c_str(), path_.c_str()) != 0) throw cannot_be_written(path_, system_error_text());
  name_.clear();
}

void make_folder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) throw std::runtime_error(path + ": cannot be created (" + error.message() + ")");
}

void require_regular_file(const std::string& path) {
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::status(path, ignored);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    throw cannot_be_written(path, "it is not a regular file");
  }
}

void require_writable_file(const std::string& path) {
  require_regular_file(path);
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::symlink_status(path, error);
  if (!std::filesystem::status_known(status)) throw cannot_be_written(path, error.message());
  if (is_replaceable(path)) {
    PartFile made_and_gone(path);
  } else if (!std::filesystem::exists(path, error)) {
    PartFile part_file_of_link_target(std::filesystem::weakly_canonical(std::filesystem::absolute(path)));
  } else if (access(path.c_str(), W_OK) != 0) {
    throw cannot_be_written(path, system_error_text());
  }
}

void require_writable_folder(const std::string& path) {
  make_folder(path);
  PartFile made_and_gone(std::filesystem::path(path) / "");
}

void write_file_atomically(const std::string& path, const std::function<void(std::ostream&)>& write) {
  std::optional<PartFile> part;
  if (is_replaceable(path)) part.emplace(path);
  errno = 0;
  std::ofstream stream(part ? part->name() : path, std::ios::binary | std::ios::trunc);
  if (!stream) throw cannot_be_written(path, system_error_text());
  stream.imbue(std::locale::classic());
  write(stream);
  stream.close();
  if (!stream) throw cannot_be_written(path, system_error_text());
  if (part) part->put_in_place();
}

}  // namespace mono_pose_tracker
