#pragma once

#include <algorithm>
#include <atomic>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "common/start_threads.h"

namespace mono_pose_tracker {

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

}  // namespace mono_pose_tracker
