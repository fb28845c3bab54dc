#include "io/temporary_file.h"

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

namespace mono_pose_tracker {

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
