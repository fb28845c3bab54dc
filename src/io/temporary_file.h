#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace mono_pose_tracker {

/// A file without a name: the system removes it when it is closed or the process ends, however that happens.
class TemporaryFile {
 public:
  /// folder: empty: that of the system (TMPDIR, else /tmp). Where no file can be made there, every append
  /// fails. max_bytes: of the file, which takes at most half of the free space.
  TemporaryFile(const std::string& folder, std::uint64_t max_bytes);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  /// Where the next bytes will be.
  std::uint64_t size() const { return size_; }
  /// False where they do not fit; size is unchanged then.
  bool append(const std::string& bytes);
  /// False on a read error.
  bool read(std::uint64_t begin, std::string* bytes) const;

 private:
  int descriptor_ = -1;
  std::uint64_t max_bytes_ = 0, size_ = 0;
};

}  // namespace mono_pose_tracker
