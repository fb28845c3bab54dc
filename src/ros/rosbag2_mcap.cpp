#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <map>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "common/text.h"
#include "rosbag2_storage.h"

namespace mono_pose_tracker {
namespace {

constexpr char kMcapMagic[] = "\x89MCAP0\r\n";
constexpr std::size_t kMcapMagicSize = 8;

// Kinds of records (mcap.dev/spec).
enum McapRecord : std::uint8_t {
  kMcapSchema = 0x03,
  kMcapChannel = 0x04,
  kMcapMessage = 0x05,
  kMcapChunk = 0x06,
  kMcapMessageIndex = 0x07,
};

/// Takes little-endian values off the front of a record.
class McapFields {
 public:
  explicit McapFields(std::string_view bytes) : bytes_(bytes) {}

  std::uint64_t number(std::size_t size) {
    const std::string_view digits = take(size);
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i) {
      value |= std::uint64_t{static_cast<std::uint8_t>(digits[i])} << (8 * i);
    }
    return value;
  }
  std::string text() { return std::string(take(number(4))); }
  std::string_view take(std::uint64_t size) {
    if (size > bytes_.size()) throw std::runtime_error("a record is truncated");
    const std::string_view result = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return result;
  }
  std::string_view rest() const { return bytes_; }
  bool empty() const { return bytes_.empty(); }

 private:
  std::string_view bytes_;
};

struct McapChannel {
  std::uint64_t schema = 0;
  std::string topic, encoding;
};

/// What is known of a file's topics.
struct McapSchemas {
  std::map<std::uint64_t, std::string> schemas;  // names by id
  std::map<std::uint64_t, McapChannel> channels;

  void add(std::uint8_t kind, std::string_view record) {
    McapFields fields(record);
    const std::uint64_t id = fields.number(2);
    if (kind == kMcapSchema) {
      schemas[id] = fields.text();
    } else if (kind == kMcapChannel) {
      McapChannel channel;
      channel.schema = fields.number(2);
      channel.topic = fields.text();
      channel.encoding = fields.text();
      channels[id] = std::move(channel);
    }
  }
};

/// Calls visit(kind, content) for each record.
template <typename Visit>
void for_each_record(std::string_view records, const Visit& visit) {
  McapFields fields(records);
  while (!fields.empty()) {
    const auto kind = static_cast<std::uint8_t>(fields.number(1));
    visit(kind, fields.take(fields.number(8)));
  }
}

/// A file from record to record. What is not asked for is passed over.
class McapFile {
 public:
  McapFile(const std::string& path, const StorageOptions& options) : path_(path), options_(options) {
    errno = 0;
    stream_.open(path, std::ios::binary);
    if (!stream_) refuse(system_error_text());
    stream_.seekg(0, std::ios::end);
    size_ = static_cast<std::uint64_t>(stream_.tellg());
    char magic[kMcapMagicSize] = {};
    stream_.seekg(0);
    stream_.read(magic, kMcapMagicSize);
    if (!stream_ || std::memcmp(magic, kMcapMagic, kMcapMagicSize) != 0)
      refuse("it does not begin with the MCAP signature");
    at_ = kMcapMagicSize;
  }

  [[noreturn]] void refuse(const std::string& problem) const {
    throw std::runtime_error(path_ + ": cannot be read as MCAP (" + one_line(problem) +
                             "): expected an .mcap file");
  }

  /// The kind of the next record; nothing at the end of the file or where a recording was cut.
  std::optional<std::uint8_t> next() {
    at_ += left_;
    left_ = 0;
    if (at_ + kHeadSize > size_) return std::nullopt;
    stream_.clear();
    stream_.seekg(static_cast<std::streamoff>(at_));
    char head[kHeadSize];
    stream_.read(head, sizeof head);
    if (!stream_) return std::nullopt;
    if (std::memcmp(head, kMcapMagic, kMcapMagicSize) == 0) return std::nullopt;  // the end's
    McapFields fields(std::string_view(head, sizeof head));
    const auto kind = static_cast<std::uint8_t>(fields.number(1));
    left_ = fields.number(8);
    at_ += sizeof head;
    if (left_ > size_ - at_) return std::nullopt;
    return kind;
  }

  std::uint64_t end_of_record() const { return at_ + left_; }
  /// The record that begins there is the next.
  void go_to(std::uint64_t begin_of_record) {
    at_ = begin_of_record;
    left_ = 0;
  }

  /// The content of the record, or its first bytes.
  std::string content(std::uint64_t most) {
    const std::uint64_t size = std::min(left_, most);
    if (size > options_.max_bytes) {
      refuse("a record of " + std::to_string(size) + " bytes: expected at most " +
             std::to_string(options_.max_bytes));
    }
    std::string bytes(size, '\0');
    stream_.clear();
    stream_.seekg(static_cast<std::streamoff>(at_));
    stream_.read(bytes.data(), static_cast<std::streamsize>(size));
    if (!stream_) refuse("read error");
    return bytes;
  }
  std::string content() { return content(left_); }

  std::string chunk_records() {
    const std::string chunk = content();
    McapFields fields(chunk);
    fields.take(8 + 8);  // first and last time
    const std::uint64_t size = fields.number(8);
    fields.take(4);  // CRC of what the compression checks as well
    const std::string compression = fields.text();
    const std::string_view data = fields.take(fields.number(8));
    if (size > options_.max_bytes) {
      refuse("a chunk of " + std::to_string(size) + " bytes: expected at most " +
             std::to_string(options_.max_bytes));
    }
    std::string records = decompress(compression, data.data(), data.size(), size);
    if (records.size() != size) throw std::runtime_error("the size of a chunk differs from its header");
    return records;
  }

 private:
  static constexpr std::uint64_t kHeadSize = 9;  // kind and size of a record

  const std::string path_;
  const StorageOptions options_;
  std::ifstream stream_;
  std::uint64_t size_ = 0;
  std::uint64_t at_ = 0;    // of the record's content
  std::uint64_t left_ = 0;  // its size
};

class McapCursor : public MessageCursor {
 public:
  McapCursor(const std::string& path, const StorageOptions& options, McapSchemas schemas, std::string topic,
             int size)
      : file_(path, options),
        schemas_(std::move(schemas)),
        topic_(std::move(topic)),
        size_(size),
        unread_(file_.end_of_record()) {}

  bool next(StoredMessage* message) override {
    if (!go_to_next()) return false;
    const std::size_t at = at_++;
    if (held_part_ != part_) read_part(part_);
    *message = std::move(held_[at]);
    return true;
  }

  bool skip() override {
    if (!go_to_next()) return false;
    ++at_;
    return true;
  }

  void rewind() override {
    part_ = at_ = 0;
    held_part_ = kNone;
  }

  int size() const override { return size_; }

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  /// A chunk, or a record outside chunks, that holds messages of the topic. A damaged one counts as a
  /// message.
  struct Part {
    std::uint64_t begin = 0;
    std::size_t messages = 0;
  };

  /// Whether there is a next message: that with number at_ of part_.
  bool go_to_next() {
    while (part_ == parts_.size() || at_ == parts_[part_].messages) {
      if (part_ == parts_.size()) {
        if (!find_part()) return false;
      } else {
        ++part_;
        at_ = 0;
      }
    }
    return true;
  }

  bool is_wanted(std::uint64_t channel) const {
    const auto found = schemas_.channels.find(channel);
    return found != schemas_.channels.end() && found->second.topic == topic_;
  }

  void keep(std::string_view record) {
    McapFields fields(record);
    if (!is_wanted(fields.number(2))) return;
    fields.number(4);  // sequence
    StoredMessage message;
    message.time_ns = static_cast<std::int64_t>(fields.number(8));
    fields.number(8);  // time of publishing
    message.data = std::string(fields.rest());
    held_.push_back(std::move(message));
  }

  void take_record(std::uint8_t kind, std::string_view record) {
    if (kind == kMcapSchema || kind == kMcapChannel) schemas_.add(kind, record);
    if (kind == kMcapMessage) keep(record);
  }

  /// Reads on until a part is found that was not known; false at the end.
  bool find_part() {
    for (const std::size_t before = parts_.size(); parts_.size() == before;) {
      file_.go_to(unread_);
      if (!file_.next()) return false;
      const std::uint64_t begin = std::exchange(unread_, file_.end_of_record());
      parts_.push_back({begin, 1});
      try {
        read_part(before);
      } catch (const std::runtime_error&) {
        ++at_;
        throw;
      }
      parts_.back().messages = held_.size();
      if (held_.empty()) parts_.pop_back();
    }
    return true;
  }

  void read_part(std::size_t part) {
    held_.clear();
    held_part_ = kNone;
    file_.go_to(parts_[part].begin);
    const std::optional<std::uint8_t> kind = file_.next();
    if (!kind) throw std::runtime_error("the file has changed");
    try {
      if (*kind == kMcapChunk) {
        const std::string records = file_.chunk_records();
        for_each_record(records,
                        [&](std::uint8_t inner, std::string_view record) { take_record(inner, record); });
        std::stable_sort(held_.begin(), held_.end(), [](const StoredMessage& a, const StoredMessage& b) {
          return a.time_ns < b.time_ns;
        });
      } else if (*kind == kMcapMessage || *kind == kMcapSchema || *kind == kMcapChannel) {
        take_record(*kind, file_.content());
      }
    } catch (const std::runtime_error& error) {
      // A damaged chunk; the next may be sound.
      held_.clear();
      throw std::runtime_error(std::string("a part of the file is damaged: ") + error.what());
    }
    held_part_ = part;
  }

  McapFile file_;
  McapSchemas schemas_;
  const std::string topic_;
  const int size_;
  std::uint64_t unread_;     // where what has not been read begins
  std::vector<Part> parts_;  // those that have been read, in order
  std::size_t part_ = 0, at_ = 0;
  std::vector<StoredMessage> held_;  // of one part; those given out are empty
  std::size_t held_part_ = kNone;
};

class McapStorage : public MessageStorage {
 public:
  McapStorage(const std::string& path, const StorageOptions& options) : path_(path), options_(options) {
    read_outside_chunks();
    // Without a summary the topics are named in the chunks alone.
    if (schemas_.channels.empty()) read_chunks();
    if (schemas_.channels.empty())
      McapFile(path_, options_).refuse("it names no topic, so it is empty or damaged");
  }

  std::vector<StoredTopic> topics() const override {
    std::map<std::string, StoredTopic> by_name;
    for (const auto& [id, channel] : schemas_.channels) {
      const auto schema = schemas_.schemas.find(channel.schema);
      by_name[channel.topic] = {channel.topic, schema == schemas_.schemas.end() ? "" : schema->second,
                                channel.encoding};
    }
    std::vector<StoredTopic> topics;
    for (auto& entry : by_name) topics.push_back(std::move(entry.second));
    return topics;
  }

  std::unique_ptr<MessageCursor> open(const std::string& topic) const override {
    int size = are_counted_ ? 0 : -1;
    for (const auto& [id, channel] : schemas_.channels) {
      const auto count = counts_.find(id);
      if (are_counted_ && channel.topic == topic && count != counts_.end()) size += count->second;
    }
    return std::make_unique<McapCursor>(path_, options_, schemas_, topic, size);
  }

 private:
  /// Schemas, channels, and how many messages each chunk's index names.
  void read_outside_chunks() {
    McapFile file(path_, options_);
    int chunks = 0, indexes = 0, messages = 0;
    bool is_after_chunk = false;
    while (const std::optional<std::uint8_t> kind = file.next()) {
      if (*kind == kMcapChunk) {
        ++chunks;
        is_after_chunk = true;
      } else if (*kind == kMcapSchema || *kind == kMcapChannel) {
        add_schema(file, *kind);
      } else if (*kind == kMcapMessage) {
        const std::string head = file.content(2);
        ++counts_[McapFields(head).number(2)];
        ++messages;
      } else if (*kind == kMcapMessageIndex) {
        indexes += std::exchange(is_after_chunk, false);
        const std::string head = file.content(2 + 4);
        McapFields fields(head);
        const std::uint64_t channel = fields.number(2);
        counts_[channel] += static_cast<int>(std::min<std::uint64_t>(fields.number(4) / 16, 1u << 24));
      }
    }
    are_counted_ = chunks == indexes && (chunks > 0 || messages > 0);
  }

  void read_chunks() {
    McapFile file(path_, options_);
    while (const std::optional<std::uint8_t> kind = file.next()) {
      if (*kind != kMcapChunk) continue;
      try {
        for_each_record(file.chunk_records(), [&](std::uint8_t inner, std::string_view record) {
          if (inner == kMcapSchema || inner == kMcapChannel) schemas_.add(inner, record);
        });
      } catch (const std::runtime_error&) {  // the cursor says so where its messages are read
      }
    }
  }

  void add_schema(McapFile& file, std::uint8_t kind) {
    try {
      schemas_.add(kind, file.content());
    } catch (const std::runtime_error& error) {
      file.refuse(error.what());
    }
  }

  const std::string path_;
  const StorageOptions options_;
  McapSchemas schemas_;
  std::map<std::uint64_t, int> counts_;  // of messages, by channel
  bool are_counted_ = false;
};

}  // namespace

std::unique_ptr<MessageStorage> open_mcap_storage(const std::string& path, const StorageOptions& options) {
  return std::make_unique<McapStorage>(path, options);
}

}  // namespace mono_pose_tracker
