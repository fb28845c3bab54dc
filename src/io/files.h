#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <istream>
#include <ostream>
#include <string>

namespace mono_pose_tracker {

/// Appends what is left of the stream, block by block: what its size was said to be, and whether it has an
/// end, is not relied on. False as soon as there are more than max_bytes; a stream that failed is bad() then.
template <typename Bytes>
bool read_whole(std::istream& stream, std::size_t max_bytes, Bytes* bytes) {
  constexpr std::size_t kBlock = 64 * 1024;
  while (stream) {
    const std::size_t before = bytes->size();
    bytes->resize(before + kBlock);
    stream.read(reinterpret_cast<char*>(bytes->data()) + before, static_cast<std::streamsize>(kBlock));
    bytes->resize(before + static_cast<std::size_t>(stream.gcount()));
    if (bytes->size() > max_bytes) return false;
  }
  return true;
}

/// The whole content of a file, without the byte order mark that UTF-8 may begin with. Throws
/// std::runtime_error, one line naming the path, the reason and `expected` (what the file should have been),
/// when it cannot be read or has more than max_bytes: a device never ends. By default a line of a hundred
/// characters for each image of a day at 30 Hz fits.
std::string read_text_file(const std::string& path, const std::string& expected,
                           std::size_t max_bytes = std::size_t{1} << 28);

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
