#pragma once

#include <atomic>
#include <functional>
#include <thread>
#include <vector>

namespace mono_pose_tracker {

/// Calls work(0) to work(count - 1), each once, in any order, on up to `threads` threads; returns when all
/// are done.
inline void parallel_for(int count, int threads, const std::function<void(int)>& work) {
  std::atomic<int> next{0};
  const auto loop = [&] {
    for (int i = next++; i < count; i = next++) work(i);
  };
  std::vector<std::thread> others;
  for (int i = 1; i < threads; ++i) others.emplace_back(loop);
  loop();
  for (std::thread& thread : others) thread.join();
}

}  // namespace mono_pose_tracker
