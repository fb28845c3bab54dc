#pragma once

#include <image_transport/image_transport.h>
#include <ros/node_handle.h>

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/image_coding.h"
#include "mono_pose_tracker/common/status.h"
#include "ros/reporting.h"

namespace mono_pose_tracker {

/// Decides by its stamp whether an image may be tracked: stamps must grow. A small step back is a late image,
/// a large one a restart of the recording.
class TimeGuard {
 public:
  enum class Verdict { kAccept, kStale, kJumpedBack };

  /// jump_ns: a step back larger than this is a new start.
  explicit TimeGuard(std::int64_t jump_ns) : jump_ns_(jump_ns) {}

  Verdict check(std::int64_t stamp_ns) {
    if (last_ns_ && stamp_ns <= *last_ns_ && *last_ns_ - stamp_ns <= jump_ns_) return Verdict::kStale;
    const bool jumped = last_ns_ && stamp_ns < *last_ns_;
    last_ns_ = stamp_ns;
    return jumped ? Verdict::kJumpedBack : Verdict::kAccept;
  }

  /// The newest stamp accepted.
  std::optional<std::int64_t> last() const { return last_ns_; }

  /// Forgets the past: the next image is accepted whatever its stamp.
  void restart() { last_ns_.reset(); }

 private:
  std::int64_t jump_ns_;
  std::optional<std::int64_t> last_ns_;
};

/// Queue of images for the processing thread. With room for one (the default) only the newest image is kept.
/// It also carries commands, so that only that thread uses the tracker. All members may be called from any
/// thread.
template <typename Item>
class ImageSlot {
 public:
  using Command = std::function<void()>;

  /// on_error: gets the text of an exception that a command throws; it ends neither the others nor the
  /// thread.
  explicit ImageSlot(std::size_t capacity = 1, std::function<void(const std::string&)> on_error = nullptr)
      : capacity_(capacity > 0 ? capacity : 1), on_error_(std::move(on_error)) {}

  /// Returns the item that was displaced, if any (the item itself once the slot is closed).
  std::optional<Item> put(Item item) {
    std::optional<Item> displaced;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (closed_) return item;
      if (items_.size() == capacity_) {
        displaced = std::move(items_.front());
        items_.pop_front();
      }
      items_.push_back(std::move(item));
    }
    changed_.notify_one();
    return displaced;
  }

  /// Commands run before the next item, in their order. False once the slot is closed.
  bool post(Command command) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (closed_) return false;
      commands_.push_back(std::move(command));
    }
    changed_.notify_one();
    return true;
  }

  /// Waits for an item and returns it; meanwhile runs commands. Nothing once the slot is closed.
  std::optional<Item> take() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return closed_ || !commands_.empty() || !items_.empty(); });
      if (closed_) return std::nullopt;
      if (!commands_.empty()) {
        const std::vector<Command> commands = std::exchange(commands_, {});
        lock.unlock();
        for (const Command& command : commands) {
          guarded(command, [this](const std::string& text) {
            if (on_error_) on_error_(text);
          });
        }
        lock.lock();
        continue;
      }
      std::optional<Item> item = std::move(items_.front());
      items_.pop_front();
      return item;
    }
  }

  /// Closes the slot: wakes the waiting thread and drops everything queued.
  void close() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      closed_ = true;
      items_.clear();
      commands_.clear();
    }
    changed_.notify_all();
  }

 private:
  const std::size_t capacity_;
  const std::function<void(const std::string&)> on_error_;
  std::mutex mutex_;  // guards all below
  std::condition_variable changed_;
  std::deque<Item> items_;
  std::vector<Command> commands_;
  bool closed_ = false;
};

/// What to subscribe to.
struct ImageTopic {
  std::string name, transport;
  std::uint64_t max_pixels = kMaxImagePixels;  // of compressed images that are decoded here
};

/// Subscribes to an image topic through image_transport. Without the plugin of the transport "compressed" the
/// images of <topic>/compressed are decoded here.
class ImageSubscriber {
 public:
  using Callback = std::function<void(const sensor_msgs::ImageConstPtr&)>;
  /// Called for an image that could not be delivered, or on which the callback failed, with the reason.
  using Refusal = std::function<void(const std_msgs::Header&, Reason, const std::string&)>;

  /// No exception leaves either callback. Throws image_transport::TransportLoadException, naming the
  /// transport, when it is not available.
  void subscribe(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle,
                 const ImageTopic& source, Callback callback, Refusal refuse);

  /// The resolved name of the topic in fact subscribed to.
  std::string topic() const;
  std::uint32_t publishers() const;

 private:
  image_transport::Subscriber transported_;
  ros::Subscriber compressed_;
};

}  // namespace mono_pose_tracker
