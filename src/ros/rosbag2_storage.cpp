#include <lz4frame.h>
#include <zstd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>

#include "common/text.h"
#include "io/image_source.h"
#include "io/yaml_file.h"
#include "ros/rosbag2_image_source.h"
#include "rosbag2_storage.h"

namespace mono_pose_tracker {
namespace {

constexpr std::size_t kDecompressedStep = std::size_t{1} << 20;  // what the result grows by, at most

[[noreturn]] void refuse_compressed(const std::string& problem) {
  throw std::runtime_error("cannot be decompressed (" + one_line(problem) + ")");
}

void require_bounded(std::size_t size, std::uint64_t max_bytes) {
  if (size > max_bytes) refuse_compressed("it has more than " + std::to_string(max_bytes) + " bytes");
}

std::string decompress_zstd(const char* data, std::size_t size, std::uint64_t max_bytes) {
  const std::unique_ptr<ZSTD_DCtx, std::size_t (*)(ZSTD_DCtx*)> context(ZSTD_createDCtx(), ZSTD_freeDCtx);
  if (!context) refuse_compressed("no memory");
  ZSTD_inBuffer in{data, size, 0};
  std::string result;
  std::size_t left = 1;
  while (left != 0) {
    const std::size_t before = result.size();
    result.resize(before + kDecompressedStep);
    ZSTD_outBuffer out{result.data() + before, kDecompressedStep, 0};
    const std::size_t read = in.pos;
    left = ZSTD_decompressStream(context.get(), &out, &in);
    if (ZSTD_isError(left)) refuse_compressed(ZSTD_getErrorName(left));
    result.resize(before + out.pos);
    require_bounded(result.size(), max_bytes);
    if (left != 0 && out.pos == 0 && in.pos == read) refuse_compressed("it is truncated");
  }
  return result;
}

std::string decompress_lz4(const char* data, std::size_t size, std::uint64_t max_bytes) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION))) refuse_compressed("no memory");
  const std::unique_ptr<LZ4F_dctx, LZ4F_errorCode_t (*)(LZ4F_dctx*)> context(made,
                                                                             LZ4F_freeDecompressionContext);
  std::string result;
  std::size_t left = 1;
  while (left != 0) {
    const std::size_t before = result.size();
    result.resize(before + kDecompressedStep);
    std::size_t written = kDecompressedStep, read = size;
    left = LZ4F_decompress(context.get(), result.data() + before, &written, data, &read, nullptr);
    if (LZ4F_isError(left)) refuse_compressed(LZ4F_getErrorName(left));
    result.resize(before + written);
    require_bounded(result.size(), max_bytes);
    if (left != 0 && written == 0 && read == 0) refuse_compressed("it is truncated");
    data += read;
    size -= read;
  }
  return result;
}

}  // namespace

std::string decompress(const std::string& compression, const char* data, std::size_t size,
                       std::uint64_t max_bytes) {
  if (compression == "zstd") return decompress_zstd(data, size, max_bytes);
  if (compression == "lz4") return decompress_lz4(data, size, max_bytes);
  if (!compression.empty()) {
    refuse_compressed("'" + compression.substr(0, 20) + "' is not known: expected zstd, lz4 or none");
  }
  require_bounded(size, max_bytes);
  return std::string(data, size);
}

namespace {

namespace fs = std::filesystem;

constexpr const char* kBagExpected = "a rosbag2 folder with metadata.yaml, a .db3 or an .mcap file";

[[noreturn]] void refuse_bag(const fs::path& path, const std::string& problem) {
  throw std::runtime_error(path.string() + ": " + problem + ": expected " + kBagExpected);
}

bool is_compressed_as_a_whole(const fs::path& path) {
  const std::string inner = path.stem().extension().string();
  return path.extension() == ".zstd" && (inner == ".db3" || inner == ".mcap");
}

std::unique_ptr<MessageStorage> open_storage_file(const fs::path& path, const StorageOptions& options) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) refuse_bag(path, "does not exist or is not a regular file");
  if (is_compressed_as_a_whole(path)) {
    refuse_bag(path, "is compressed as a whole (decompress it with `zstd -d`)");
  }
  switch (storage_kind(path.string())) {
    case StorageKind::kSqlite:
      return open_sqlite_storage(path.string(), options);
    case StorageKind::kMcap:
      return open_mcap_storage(path.string(), options);
    case StorageKind::kOther:
      break;
  }
  refuse_bag(path, "has the extension '" + one_line(path.extension().string()) + "'");
}

/// rosbag2 compresses messages one by one, which metadata.yaml alone says. A CDR message begins with a zero.
bool is_zstd_frame(const std::string& data) { return data.compare(0, 4, "\x28\xb5\x2f\xfd") == 0; }

/// Of a recording that was split: one file after the other, each when the one before has ended.
class SplitCursor : public MessageCursor {
 public:
  SplitCursor(const std::vector<std::shared_ptr<MessageStorage>>& parts, const std::string& topic,
              const StorageOptions& options)
      : options_(options) {
    for (const auto& part : parts) {
      cursors_.push_back(part->open(topic));
      const int size = cursors_.back()->size();
      size_ = size < 0 || size_ < 0 ? -1 : size_ + size;
    }
  }

  bool next(StoredMessage* message) override {
    while (at_ < cursors_.size() && !cursors_[at_]->next(message)) ++at_;
    if (at_ == cursors_.size()) return false;
    if (is_zstd_frame(message->data)) {
      message->data = decompress("zstd", message->data.data(), message->data.size(), options_.max_bytes);
    }
    return true;
  }

  bool skip() override {
    while (at_ < cursors_.size() && !cursors_[at_]->skip()) ++at_;
    return at_ < cursors_.size();
  }

  void rewind() override {
    for (const auto& cursor : cursors_) cursor->rewind();
    at_ = 0;
  }

  int size() const override { return size_; }

 private:
  const StorageOptions options_;
  std::vector<std::unique_ptr<MessageCursor>> cursors_;
  std::size_t at_ = 0;
  int size_ = 0;
};

class SplitStorage : public MessageStorage {
 public:
  SplitStorage(const std::vector<fs::path>& paths, const StorageOptions& options) : options_(options) {
    for (const fs::path& path : paths) parts_.push_back(open_storage_file(path, options));
  }

  std::vector<StoredTopic> topics() const override {
    std::map<std::string, StoredTopic> by_name;
    for (const auto& part : parts_) {
      for (StoredTopic& topic : part->topics()) by_name.emplace(topic.name, topic);
    }
    std::vector<StoredTopic> topics;
    for (auto& entry : by_name) topics.push_back(std::move(entry.second));
    return topics;
  }

  std::unique_ptr<MessageCursor> open(const std::string& topic) const override {
    return std::make_unique<SplitCursor>(parts_, topic, options_);
  }

 private:
  const StorageOptions options_;
  std::vector<std::shared_ptr<MessageStorage>> parts_;
};

/// The path, or that of the decompressed file in the same folder where the path's is compressed as a whole.
fs::path decompressed_or_itself(const fs::path& path) {
  std::error_code ignored;
  const fs::path decompressed = path.parent_path() / path.stem();
  return is_compressed_as_a_whole(path) && fs::exists(decompressed, ignored) ? decompressed : path;
}

std::string text_at(const YamlValue& map, const char* key) {
  const YamlValue* const value = map.find(key);
  return value ? value->text : "";
}

/// The files that a folder's metadata.yaml names.
std::vector<fs::path> files_of_metadata(const fs::path& folder) {
  const fs::path path = folder / "metadata.yaml";
  const YamlValue root = read_yaml_file(path.string(), "the metadata of a rosbag2 folder");
  const YamlValue* const information = root.find("rosbag2_bagfile_information");
  const YamlValue* const files = information ? information->find("relative_file_paths") : nullptr;
  if (!files || files->items.empty()) refuse_bag(path, "has no relative_file_paths");
  std::vector<fs::path> paths;
  for (const YamlValue& item : files->items) {
    const fs::path file = item.text;
    if (file.empty() || file.is_absolute() || *file.lexically_normal().begin() == "..") {
      refuse_bag(path, "names a file outside the folder, '" + one_line(item.text) + "'");
    }
    // Early releases wrote the folder's name as well.
    const fs::path named = decompressed_or_itself(folder / file);
    std::error_code ignored;
    const bool is_here = fs::exists(named, ignored);
    paths.push_back(is_here ? named : decompressed_or_itself(folder / file.filename()));
  }
  const std::string mode = text_at(*information, "compression_mode");
  const std::string format = text_at(*information, "compression_format");
  if ((mode == "MESSAGE" || mode == "message") && format != "zstd") {
    refuse_bag(path, "has messages compressed by '" + one_line(format) + "', only zstd is read");
  }
  return paths;
}

/// Where there is no metadata.yaml, as of a recording that was cut: the files of one kind, by name.
std::vector<fs::path> storage_files(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const fs::path extension = entry->path().extension();
    if (extension == ".db3" || extension == ".mcap") names.push_back(entry->path().filename().string());
  }
  std::vector<fs::path> files;
  for (const std::string& name : in_order_of_names(std::move(names))) files.push_back(folder / name);
  return files;
}

}  // namespace

StorageKind storage_kind(const std::string& path) {
  std::string head(16, '\0');
  std::ifstream(path, std::ios::binary).read(head.data(), static_cast<std::streamsize>(head.size()));
  const std::string extension = fs::path(path).extension().string();
  if (head.compare(0, 5, "\x89MCAP") == 0) return StorageKind::kMcap;
  if (head.compare(0, 15, "SQLite format 3") == 0) return StorageKind::kSqlite;
  if (extension == ".mcap") return StorageKind::kMcap;
  return extension == ".db3" ? StorageKind::kSqlite : StorageKind::kOther;
}

bool is_rosbag2(const std::string& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    return fs::exists(fs::path(path) / "metadata.yaml", ignored) || !storage_files(path).empty();
  }
  return storage_kind(path) != StorageKind::kOther || is_compressed_as_a_whole(path);
}

std::unique_ptr<MessageStorage> open_rosbag2(const std::string& path, const StorageOptions& options) {
  std::error_code ignored;
  std::vector<fs::path> files;
  if (!fs::is_directory(path, ignored)) {
    files = {path};
  } else if (fs::exists(fs::path(path) / "metadata.yaml", ignored)) {
    files = files_of_metadata(path);
  } else {
    files = storage_files(path);
    if (files.empty()) refuse_bag(path, "holds no recording");
  }
  return std::make_unique<SplitStorage>(files, options);
}

}  // namespace mono_pose_tracker
