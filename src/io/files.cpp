#include "io/files.h"

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <locale>
#include <optional>
#include <stdexcept>
#include <system_error>

#include "common/text.h"

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

namespace fs = std::filesystem;

namespace {

int open_without_name(const fs::path& folder) {
#ifdef O_TMPFILE
  const int descriptor = open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (descriptor >= 0) return descriptor;
#endif
  std::string name = (folder / "mono_pose_tracker_XXXXXX").string();  // not every file system has the above
  const int named = mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) unlink(name.c_str());
  return named;
}

}  // namespace

TemporaryFile::TemporaryFile(const std::string& folder, std::uint64_t max_bytes) {
  std::error_code error;
  const fs::path place = folder.empty() ? fs::temp_directory_path(error) : fs::path(folder);
  const fs::space_info space = fs::space(place, error);
  if (error) return;
  max_bytes_ = std::min<std::uint64_t>(max_bytes, space.available / 2);
  descriptor_ = open_without_name(place);
}

TemporaryFile::~TemporaryFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

bool TemporaryFile::append(const std::string& bytes) {
  if (descriptor_ < 0 || bytes.size() > max_bytes_ - size_) return false;
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t written =
        pwrite(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(size_ + done));
    if (written <= 0) return false;
    done += static_cast<std::size_t>(written);
  }
  size_ += bytes.size();
  return true;
}

bool TemporaryFile::read(std::uint64_t begin, std::string* bytes) const {
  for (std::size_t done = 0; done < bytes->size();) {
    const ssize_t got =
        pread(descriptor_, bytes->data() + done, bytes->size() - done, static_cast<off_t>(begin + done));
    if (got <= 0) return false;
    done += static_cast<std::size_t>(got);
  }
  return true;
}

}  // namespace mono_pose_tracker
