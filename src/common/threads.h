#pragma once

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace mono_pose_tracker {

/// Processors of the machine, 1 where it does not say.
inline int processors() { return std::max(1, static_cast<int>(std::thread::hardware_concurrency())); }

/// Starts up to `most` threads that call work(). Starts fewer or none where the system grants no more (limits
/// of a user, a container, the address space), so any number of threads must be able to share the work. The
/// caller joins them.
template <typename Work>
std::vector<std::thread> start_threads(int most, const Work& work) {
  std::vector<std::thread> threads;
  threads.reserve(static_cast<std::size_t>(most > 0 ? most : 0));  // nothing else may throw below
  try {
    for (int i = 0; i < most; ++i) threads.emplace_back(work);
  } catch (const std::system_error&) {
  } catch (const std::bad_alloc&) {
  }
  return threads;
}

/// Pieces of work that threads take one after the other until none is left, or one has thrown.
class SharedWork {
 public:
  /// Of work(0) to work(count - 1); `work` must outlive it.
  SharedWork(int count, const std::function<void(int)>& work) : count_(count), work_(work) {}

  /// Does pieces until none is left.
  void take_part() {
    try {
      for (int i = next_++; i < count_; i = next_++) work_(i);
    } catch (...) {
      next_ = count_;
      const std::lock_guard<std::mutex> lock(mutex_);
      error_ = std::current_exception();
    }
  }
  /// When nobody takes part any more: throws what was thrown, one of them when there were several.
  void rethrow_error() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  const int count_;
  const std::function<void(int)>& work_;
  std::atomic<int> next_{0};
  std::mutex mutex_;
  std::exception_ptr error_;
};

/// Calls work(0) to work(count - 1), each once, in any order, on up to `threads` threads including the
/// caller's. Returns when all calls are done. Each call must write to its own place; the result is then the
/// same for any number of threads. After an exception no further calls begin, and one of the exceptions is
/// rethrown here.
inline void parallel_for(int count, int threads, const std::function<void(int)>& work) {
  if (threads <= 1 || count <= 1) {
    for (int i = 0; i < count; ++i) work(i);
    return;
  }
  SharedWork shared(count, work);
  std::vector<std::thread> others = start_threads(std::min(threads, count) - 1, [&] { shared.take_part(); });
  shared.take_part();
  for (std::thread& thread : others) thread.join();
  shared.rethrow_error();
}

/// Repeated parallel_for: the threads are started once. Each thread spins for 0.1 ms after its share of the
/// work, and the caller spins until all are done. Only useful where pieces of work are shorter than 0.1 ms
/// (the time to start a thread) and follow one another.
///
/// One thread at a time may call it, and work must not call it again. Fewer threads, or none but the
/// caller's, where the system grants no more.
class ThreadTeam {
 public:
  /// The caller's thread is one of them; the others start with the first work that they can share.
  explicit ThreadTeam(int threads) : others_(threads - 1) {}
  ~ThreadTeam();
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;

  int threads() const { return others_ + 1; }

  /// As parallel_for(count, threads(), work).
  void for_each(int count, const std::function<void(int)>& work);
  /// Hands out up to `run` indices at a time, for calls that take less time than handing one out.
  template <typename Work>
  void for_runs(int count, int run, const Work& work) {
    for_each((count + run - 1) / run, [&](int r) {
      for (int i = r * run; i < (r + 1) * run && i < count; ++i) work(i);
    });
  }

 private:
  void start(int wanted);
  void help();
  bool wait_for_work(unsigned done);

  const int others_;
  int started_ = 0;  // or refused
  std::vector<std::thread> threads_;

  // Odd while there is work to take part in; it changes before anybody begins and after all is handed out.
  std::atomic<unsigned> round_{0};
  std::atomic<int> helping_{0};  // others that may be looking at the work
  std::atomic<int> asleep_{0};
  std::atomic<bool> ends_{false};
  std::mutex mutex_;  // of those asleep
  std::condition_variable work_or_end_;
  SharedWork* work_ = nullptr;  // of the present round
};

/// Lowers the priority of the calling thread by this many steps of niceness and limits its time slice to 0.1
/// ms while others wait (Linux 6.12 or newer). Does nothing where the system refuses.
void lower_thread_priority(int steps);

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
