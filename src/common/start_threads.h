#pragma once

#include <algorithm>
#include <new>
#include <system_error>
#include <thread>
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

}  // namespace mono_pose_tracker
