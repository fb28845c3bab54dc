#pragma once

#include <csignal>

namespace mono_pose_tracker {

/// Number of termination signals, and the last of them. Written by the handler.
inline volatile std::sig_atomic_t signals_caught = 0, last_signal = 0;

/// The next SIGINT or SIGTERM is counted, the one after it ends the program at once.
inline void end_on_signals() {
  for (const int signal : {SIGINT, SIGTERM}) {
    std::signal(signal, [](int caught) {
      last_signal = caught;
      signals_caught = signals_caught + 1;
      std::signal(caught, SIG_DFL);
    });
  }
}

/// Exit status as a shell reports it.
inline int end_status(int otherwise) {
  return signals_caught > 0 ? 128 + static_cast<int>(last_signal) : otherwise;
}

}  // namespace mono_pose_tracker
