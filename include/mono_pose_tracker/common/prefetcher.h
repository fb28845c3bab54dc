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

namespace mono_pose_tracker {

/// Works ahead on a sequence: its items are read one after the other, worked on by several threads at once,
/// and given out in the order in which they were read. What is given out does not depend on the number of
/// threads.
template <typename Item>
class Prefetcher {
 public:
  /// read: false at the end; called by one thread at a time. work: by all of them. threads: that run ahead,
  /// by no more than one item each and one that waits; 0: next() does it all when it is called.
  Prefetcher(std::function<bool(Item*)> read, std::function<void(Item*)> work, int threads)
      : read_(std::move(read)), work_(std::move(work)), most_begun_(static_cast<std::size_t>(threads) + 1) {
    for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { run(); });
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

  /// The next item; false at the end. Throws what read or work threw at that place; after that there is no
  /// more.
  bool next(Item* item) {
    if (threads_.empty()) {
      if (!read_(item)) return false;
      work_(item);
      return true;
    }
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return begun_.empty() ? ended_ : begun_.front()->done; });
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

  void run() {
    while (const std::shared_ptr<Entry> entry = read_one()) {
      try {
        work_(&entry->item);
      } catch (...) {
        entry->error = std::current_exception();
      }
      finish(entry);
    }
  }

  // Nothing at the end, when stopped, and when reading failed: the error is then given out as an item.
  std::shared_ptr<Entry> read_one() {
    const std::lock_guard<std::mutex> one_reads(reading_);
    const auto entry = std::make_shared<Entry>();
    {
      std::unique_lock<std::mutex> lock(mutex_);
      changed_.wait(lock, [this] { return stopped_ || ended_ || begun_.size() < most_begun_; });
      if (stopped_ || ended_) return nullptr;
      begun_.push_back(entry);
    }
    bool is_there = true;
    try {
      is_there = read_(&entry->item);
    } catch (...) {
      entry->error = std::current_exception();
    }
    if (is_there && !entry->error) return entry;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ended_ = true;
      if (!is_there) begun_.pop_back();  // the one just added: others add none meanwhile
    }
    if (is_there) finish(entry);
    changed_.notify_all();
    return nullptr;
  }

  void finish(const std::shared_ptr<Entry>& entry) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      entry->done = true;
    }
    changed_.notify_all();
  }

  const std::function<bool(Item*)> read_;
  const std::function<void(Item*)> work_;
  const std::size_t most_begun_;  // read and not yet given out

  std::mutex reading_;  // held while one reads, so that the order is that of the sequence
  std::mutex mutex_;    // guards what follows
  std::condition_variable changed_;
  std::deque<std::shared_ptr<Entry>> begun_;  // in the order read
  bool ended_ = false, stopped_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace mono_pose_tracker
