#pragma once

#include <algorithm>
#include <atomic>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "mono_pose_tracker/common/start_threads.h"

namespace mono_pose_tracker {

/// Calls work(0) to work(count - 1), each once, in any order, on up to `threads` threads (the caller's is one
/// of them); returns when all are done. What is called writes to a place of its own, so that the result is
/// the same for any number of threads. Where one throws, no further ones are begun, and the exception (one of
/// them, when several throw) comes out here.
inline void parallel_for(int count, int threads, const std::function<void(int)>& work) {
  if (threads <= 1 || count <= 1) {
    for (int i = 0; i < count; ++i) work(i);
    return;
  }
  std::atomic<int> next{0};
  std::mutex mutex;
  std::exception_ptr error;
  const auto loop = [&] {
    try {
      for (int i = next++; i < count; i = next++) work(i);
    } catch (...) {
      next = count;
      const std::lock_guard<std::mutex> lock(mutex);
      error = std::current_exception();
    }
  };
  std::vector<std::thread> others = start_threads(std::min(threads, count) - 1, loop);
  loop();
  for (std::thread& thread : others) thread.join();
  if (error) std::rethrow_exception(error);
}

}  // namespace mono_pose_tracker
