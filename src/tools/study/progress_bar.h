#pragma once

#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <mutex>
#include <string>

namespace mono_pose_tracker {

/// A bar on standard error while that is a terminal, nothing elsewhere. Threads may advance it at once.
class ProgressBar {
 public:
  explicit ProgressBar(int total) : total_(total), is_terminal_(isatty(STDERR_FILENO) != 0) {}
  ~ProgressBar() {
    if (is_terminal_) std::fputc('\n', stderr);
  }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void advance() {
    const long long done = ++done_;
    const int percent = static_cast<int>(100 * done / total_);
    if (!is_terminal_ || percent == static_cast<int>(100 * (done - 1) / total_)) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (percent <= shown_) return;
    shown_ = percent;
    std::fprintf(stderr, "\r[%s%s] %3d %%", std::string(percent / 2, '#').c_str(),
                 std::string(50 - percent / 2, ' ').c_str(), percent);
  }

 private:
  const int total_;
  const bool is_terminal_;
  std::atomic<long long> done_{0};
  std::mutex mutex_;  // guards shown_ and the line on the terminal
  int shown_ = 0;
};

}  // namespace mono_pose_tracker
