#pragma once

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <mutex>
#include <string>

namespace mono_pose_tracker {

/// A progress bar on standard error if that is a terminal; nothing otherwise. May be advanced by several
/// threads.
class ProgressBar {
 public:
  /// total: steps to come; not positive: not known, they are counted. quiet: nothing on a terminal either.
  explicit ProgressBar(int total, bool quiet = false)
      : total_(total), is_shown_(!quiet && isatty(STDERR_FILENO) != 0) {}
  ~ProgressBar() {
    if (is_shown_) std::fputc('\n', stderr);
  }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  bool is_shown() const { return is_shown_; }

  /// Advances by one step. Without words the bar is redrawn when it has grown, with words each time.
  void advance(const std::string& words = "") {
    const long long done = ++done_;
    const long long percent = total_ > 0 ? std::min(100LL, 100 * done / total_) : done;
    if (!is_shown_ || (words.empty() && total_ > 0 && percent == 100 * (done - 1) / total_)) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (words.empty() && percent <= shown_) return;
    shown_ = percent;
    if (total_ > 0) {
      const std::size_t filled = static_cast<std::size_t>(percent) * kWidth / 100;
      std::fprintf(stderr, "\r[%s%s] %3lld %%", std::string(filled, '#').c_str(),
                   std::string(kWidth - filled, ' ').c_str(), percent);
    } else {
      std::fprintf(stderr, "\r%lld", done);
    }
    if (!words.empty()) std::fprintf(stderr, "  %s   ", words.c_str());
  }

 private:
  static constexpr std::size_t kWidth = 30;  // characters
  const int total_;
  const bool is_shown_;
  std::atomic<long long> done_{0};
  std::mutex mutex_;  // guards shown_ and the line on the terminal
  long long shown_ = 0;
};

}  // namespace mono_pose_tracker
