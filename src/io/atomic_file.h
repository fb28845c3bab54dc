#pragma once

#include <functional>
#include <ostream>
#include <string>

namespace mono_pose_tracker {

/// A new, empty file beside `path` under a name that nothing had, so that whoever else writes `path` at the
/// same time does not meet it. Gone with this object unless it was put in its place.
class PartFile {
 public:
  /// Throws std::runtime_error naming `path` and the reason.
  explicit PartFile(const std::string& path);
  ~PartFile();
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;

  const std::string& name() const { return name_; }
  /// Renames it to `path`. Throws as the constructor.
  void put_in_place();

 private:
  const std::string path_;
  std::string name_;  // empty once it is in its place
};

/// Calls `write` with a stream on a PartFile, which it then puts in its place: a reader sees the old file or
/// the whole new one. Devices, pipes and links are written through instead. Throws std::runtime_error naming
/// the path and the reason when it cannot.
void write_file_atomically(const std::string& path, const std::function<void(std::ostream&)>& write);

/// Makes the folder, and those above it. Throws std::runtime_error naming the path and the reason when it
/// can't be.
void make_folder(const std::string& path);

/// Throws std::runtime_error naming the path when there is something there that is no file, nor a link to
/// one: who opens a pipe waits until somebody reads it.
void require_regular_file(const std::string& path);

/// Throws std::runtime_error naming the path and the reason when write_file_atomically could not write the
/// file, or it is no regular one. What is there stays as it is.
void require_writable_file(const std::string& path);

/// As require_writable_file, of new files in the folder, which is made.
void require_writable_folder(const std::string& path);

}  // namespace mono_pose_tracker
