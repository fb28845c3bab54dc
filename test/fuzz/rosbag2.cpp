// Recordings of ROS 2: the first byte chooses an MCAP file, a database, or a message in CDR.
#include <stdexcept>

#include "fuzz_target.h"
#include "ros/camera_info.h"
#include "ros/image_conversion.h"
#include "ros/rosbag2_image_source.h"
#include "ros/rosbag2_storage.h"

using namespace mono_pose_tracker;

namespace {

StorageOptions small_storage() {
  StorageOptions options;
  options.max_bytes = 1 << 20;
  return options;
}

// Every so many-th message; the others are skipped. Returns the number of all, with damaged parts.
int count(MessageCursor* cursor, int every) {
  StoredMessage message;
  for (int i = 0;; ++i) {
    try {
      if (!(i % every == 0 ? cursor->next(&message) : cursor->skip())) return i;
      FUZZ_CHECK(message.data.size() <= small_storage().max_bytes);
    } catch (const std::runtime_error& damaged) {
      FUZZ_CHECK(is_one_line(damaged.what()));
    }
  }
}

void read_all(const MessageStorage& storage) {
  for (const StoredTopic& topic : storage.topics()) {
    const std::unique_ptr<MessageCursor> cursor = storage.open(topic.name);
    const int messages = count(cursor.get(), 1);
    cursor->rewind();
    FUZZ_CHECK(count(cursor.get(), 2) == messages);
  }
}

void read_storage(const std::uint8_t* bytes, std::size_t size, bool is_mcap) {
  const MemoryFile file(bytes, size);
  read_all(*(is_mcap ? open_mcap_storage(file.path(), small_storage())
                     : open_sqlite_storage(file.path(), small_storage())));
}

void read_message(const std::string& cdr, int kind) {
  std::int64_t stamp_ns = 0;
  if (kind == 0) {
    const ConvertedImage converted = convert_image(read_ros2_image(cdr, &stamp_ns));
    FUZZ_CHECK(converted.image.empty() == (converted.reason != Reason::kOk));
  } else if (kind == 1) {
    FUZZ_CHECK(read_ros2_compressed_image(cdr, &stamp_ns).size() <= cdr.size());
  } else {
    const ConvertedCamera converted = convert_camera_info(read_ros2_camera_info(cdr, &stamp_ns), false);
    if (converted.reason == Reason::kOk) CameraModel{converted.parameters};
  }
}

}  // namespace

FUZZ_TARGET(rosbag2) {
  if (size == 0) return;
  try {
    if (bytes[0] == 'm' || bytes[0] == 'd') {
      read_storage(bytes + 1, size - 1, bytes[0] == 'm');
    } else {
      read_message(std::string(bytes + 1, bytes + size), bytes[0] % 3);
    }
  } catch (const std::runtime_error& refused) {
    FUZZ_CHECK(is_one_line(refused.what()));
  }
}
