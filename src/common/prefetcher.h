#pragma once

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "common/start_threads.h"

namespace mono_pose_tracker {

/// Works ahead on a sequence: its items are read one after the other, worked on by several threads at once,
/// and given out in the order in which they were read. What is given out does not depend on the number of
/// threads.
template <typename Item>
class Prefetcher {
 public:
  /// read: returns false at the end; one thread calls it at a time. work: called by all threads, also at
  /// once. threads: number of threads in addition to the caller's. Each reads at most one item ahead, and one
  /// more item may wait. With 0 threads, or when none can be started, next() does all the work itself.
  Prefetcher(std::function<bool(Item*)> read, std::function<void(Item*)> work, int threads)
      : read_(std::move(read)), work_(std::move(work)), most_begun_(static_cast<std::size_t>(threads) + 2) {
    threads_ = start_threads(threads, [this] { run(); });
  }

  ~Prefetcher() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stopped_ = true;
    }
    changed_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

  Prefetcher(const Prefetcher&) = delete;
  Prefetcher& operator=(const Prefetcher&) = delete;

  /// The next item; false at the end. While it is worked on elsewhere, the caller does its share of what
  /// follows. Throws what read or work threw at that place; after that there is no more.
  bool next(Item* item) {
    if (threads_.empty()) {
      if (!read_(item)) return false;
      work_(item);
      return true;
    }
    std::unique_lock<std::mutex> lock(mutex_);
    while (!is_next_known()) {
      if (can_begin()) {
        do_one(&lock);
      } else {
        changed_.wait(lock);
      }
    }
    if (begun_.empty()) return false;
    const std::shared_ptr<Entry> first = std::move(begun_.front());
    begun_.pop_front();
    lock.unlock();
    changed_.notify_all();
    if (first->error) std::rethrow_exception(first->error);
    *item = std::move(first->item);
    return true;
  }

 private:
  struct Entry {
    Item item;
    std::exception_ptr error;
    bool done = false;
  };

  // What follows is called with the lock held.
  bool is_next_known() const { return begun_.empty() ? ended_ : begun_.front()->done; }
  // One reads at a time, so that the order is that of the sequence.
  bool can_begin() const { return !stopped_ && !ended_ && !is_reading_ && begun_.size() < most_begun_; }

  void run() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (!stopped_ && !ended_) {
      if (can_begin()) {
        do_one(&lock);
      } else {
        changed_.wait(lock);
      }
    }
  }

  // Reads an item and works on it, the lock given back meanwhile.
  void do_one(std::unique_lock<std::mutex>* lock) {
    const auto entry = std::make_shared<Entry>();
    begun_.push_back(entry);
    is_reading_ = true;
    lock->unlock();
    bool is_there = true;
    const std::exception_ptr error = caught([&] { is_there = read_(&entry->item); });
    lock->lock();
    is_reading_ = false;
    if (error || !is_there) {
      ended_ = true;
      finish(*entry, error);
      if (!is_there) begun_.pop_back();  // the one just added: others add none meanwhile
      return;
    }
    changed_.notify_all();
    lock->unlock();
    const std::exception_ptr problem = caught([&] { work_(&entry->item); });
    lock->lock();
    finish(*entry, problem);
  }

  template <typename Function>
  static std::exception_ptr caught(const Function& function) {
    try {
      function();
    } catch (...) {
      return std::current_exception();
    }
    return nullptr;
  }

  // An error is given out as an item.
  void finish(Entry& entry, const std::exception_ptr& error) {
    entry.error = error;
    entry.done = true;
    changed_.notify_all();
  }

  const std::function<bool(Item*)> read_;
  const std::function<void(Item*)> work_;
  const std::size_t most_begun_;  // read and not yet given out

  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::deque<std::shared_ptr<Entry>> begun_;  // in the order read
  bool is_reading_ = false, ended_ = false, stopped_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace mono_pose_tracker
