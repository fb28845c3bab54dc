#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ros/guard.h"

namespace mono_pose_tracker {

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

}  // namespace mono_pose_tracker
