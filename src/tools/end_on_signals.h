#pragma once

#include <atomic>
#include <csignal>

namespace mono_pose_tracker {

/// Number of termination signals, and the last of them. Written by the handler, read by any thread.
inline std::atomic<int> signals_caught{0}, last_signal{0};
static_assert(std::atomic<int>::is_always_lock_free, "a handler may use no lock");

/// The next SIGINT or SIGTERM is counted; another one of either ends the program at once.
inline void end_on_signals() {
  for (const int signal : {SIGINT, SIGTERM}) {
    std::signal(signal, [](int caught) {
      last_signal = caught;
      ++signals_caught;
      std::signal(SIGINT, SIG_DFL);
      std::signal(SIGTERM, SIG_DFL);
    });
  }
}

/// Exit status as a shell reports it.
inline int end_status(int otherwise) { return signals_caught > 0 ? 128 + last_signal : otherwise; }

}  // namespace mono_pose_tracker
