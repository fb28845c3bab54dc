#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace mono_pose_tracker {

struct StorageOptions {
  /// Largest chunk or message after decompression (bytes): a small file can claim more than the available
  /// memory. Raw images of kMaxImagePixels take less.
  std::uint64_t max_bytes = std::uint64_t{1} << 30;
};

struct StoredTopic {
  std::string name, type;     // "/camera/image_raw", "sensor_msgs/msg/Image"
  std::string serialization;  // "cdr"
};

struct StoredMessage {
  std::int64_t time_ns = 0;  // of recording
  std::string data;
};

/// The messages of one topic, in the order of recording.
class MessageCursor {
 public:
  virtual ~MessageCursor() = default;
  /// False at the end. Throws std::runtime_error, one line, for a damaged part of the file, once for each:
  /// what follows may be sound.
  virtual bool next(StoredMessage* message) = 0;
  /// Passes over a message, or over a damaged part: as next, but it reads only what has not been read before.
  virtual bool skip() = 0;
  /// Goes back to the first message. Does not throw.
  virtual void rewind() = 0;
  /// How many there are in all, or -1 when that is not known.
  virtual int size() const = 0;
};

/// A file of a ROS 2 recording.
class MessageStorage {
 public:
  virtual ~MessageStorage() = default;
  virtual std::vector<StoredTopic> topics() const = 0;
  virtual std::unique_ptr<MessageCursor> open(const std::string& topic) const = 0;
};

// All throw std::runtime_error, one line that names the file, when it is not sound.

/// A database of SQLite, .db3. It is opened for reading only, and nothing is written beside it.
std::unique_ptr<MessageStorage> open_sqlite_storage(const std::string& path, const StorageOptions& options);

/// An MCAP file (mcap.dev/spec): chunks without compression, lz4 and zstd; also one without an index, as a
/// recording that was cut leaves it.
std::unique_ptr<MessageStorage> open_mcap_storage(const std::string& path, const StorageOptions& options);

/// Whether a file is an MCAP file or a database of SQLite, by its first bytes or else by its extension.
enum class StorageKind { kOther, kMcap, kSqlite };
StorageKind storage_kind(const std::string& path);

/// A file of either kind, or a folder with metadata.yaml and such files.
std::unique_ptr<MessageStorage> open_rosbag2(const std::string& path, const StorageOptions& options = {});

/// Decompresses what a frame of zstd or lz4 holds; `compression` is "zstd", "lz4" or "" (a copy). Throws
/// std::runtime_error, one line, on damage and where the result would have more than max_bytes.
std::string decompress(const std::string& compression, const char* data, std::size_t size,
                       std::uint64_t max_bytes);

}  // namespace mono_pose_tracker
