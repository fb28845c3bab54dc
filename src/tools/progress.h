#pragma once

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstddef>
#include <cstdio>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/text.h"
#include "common/threads.h"
#include "mono_pose_tracker/common/status.h"
#include "mono_pose_tracker/tracking/frame_report.h"
#include "run_estimate.h"

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

/// Progress of a run on standard error: one bar over all stages on a terminal, drawn anew each second; plain
/// lines elsewhere.
///
///     RunProgress progress(images, quiet);
///     progress.begin(RecordingStage::kTracking);
///     progress.show(report);  // of each image
class RunProgress {
 public:
  /// images: not positive: not known. quiet: nothing is printed.
  RunProgress(int images, bool quiet)
      : estimate_(images), quiet_(quiet), is_bar_(!quiet && isatty(STDERR_FILENO) != 0) {
    if (is_bar_) threads_ = start_threads(1, [this] { redraw_each_second(); });
  }
  ~RunProgress() {
    end_line();
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      has_ended_ = true;
    }
    changed_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  RunProgress(const RunProgress&) = delete;
  RunProgress& operator=(const RunProgress&) = delete;

  void begin(RecordingStage stage) {
    const std::lock_guard<std::mutex> lock(mutex_);
    estimate_.begin(stage, now());
    if (stage == RecordingStage::kTracking) count_ = 0;
    const bool is_new = stage_ != stage;
    stage_ = stage;
    if (is_bar_) draw();
    if (is_bar_ || quiet_ || !is_new || stage == RecordingStage::kTracking) return;
    std::fprintf(stderr, "%s%s\n", name_of(stage), time_left("about ").c_str());
  }

  /// Of an image that was tracked.
  void show(const FrameReport& report) {
    const std::lock_guard<std::mutex> lock(mutex_);
    estimate_.count_image();
    ++count_;
    const bool has_pose = report.map_from_camera.has_value();
    const std::string size =
        std::to_string(report.keyframes) + " keyframes, " + std::to_string(report.landmarks) + " points";
    words_ = to_string(report.state) + (", " + size);
    if (is_bar_) {
      draw();
    } else if (!quiet_ && (has_pose != had_pose_ || count_ % 50 == 0)) {
      std::fprintf(stderr, "image %d: %s%s%s, %s\n", count_, to_string(report.state),
                   report.reason_text.empty() ? "" : ", ", report.reason_text.c_str(), size.c_str());
    }
    had_pose_ = has_pose;
  }

  /// What is printed next begins on a line of its own. The bar goes on with the next stage or image.
  void end_line() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (stage_ && is_bar_) std::fputc('\n', stderr);
    stage_.reset();
  }

 private:
  static double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }

  static const char* name_of(RecordingStage stage) {
    switch (stage) {
      case RecordingStage::kTracking:
        return "tracking";
      case RecordingStage::kRefining:
        return "refining the map";
      case RecordingStage::kRegistering:
        return "registering images again";
      case RecordingStage::kWriting:
        return "writing the results";
    }
    return "";
  }

  static std::string minutes(double seconds) {
    const long whole = std::lround(std::ceil(seconds));
    return formatted("%ld:%02ld", whole / 60, whole % 60);
  }

  std::string time_left(const char* about) const {
    const std::optional<double> left = estimate_.seconds_left(now());
    return left ? ", " + std::string(about) + minutes(*left) + " min left" : "";
  }

  void draw() {
    constexpr int kWidth = 20;  // characters
    if (!stage_) return;
    const double share = estimate_.share_done(now());
    const int filled = static_cast<int>(share * kWidth);
    const std::string image = stage_ == RecordingStage::kTracking ? " image " + std::to_string(count_) : "";
    // The time that has passed changes also where the estimate is rounded to the same numbers for long.
    std::string line = formatted("[%s%s] %3d %% in %s%s; %s%s, %s", std::string(filled, '#').c_str(),
                                 std::string(kWidth - filled, ' ').c_str(), static_cast<int>(100 * share),
                                 minutes(now() - start_).c_str(), time_left("").c_str(), name_of(*stage_),
                                 image.c_str(), words_.c_str());
    winsize terminal{};
    const bool is_known = ioctl(STDERR_FILENO, TIOCGWINSZ, &terminal) == 0 && terminal.ws_col > 1;
    line.resize(std::min<std::size_t>(line.size(), is_known ? terminal.ws_col - 1 : 79));  // on one line
    std::fprintf(stderr, "\r%s\x1b[K", line.c_str());
    std::fflush(stderr);
  }

  void redraw_each_second() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (!changed_.wait_for(lock, std::chrono::seconds(1), [this] { return has_ended_; })) {
      draw();
    }
  }

  std::mutex mutex_;  // guards what follows and the line on the terminal
  RunEstimate estimate_;
  const bool quiet_, is_bar_;
  const double start_ = now();
  std::optional<RecordingStage> stage_;  // none: nothing is drawn
  std::string words_ = "no image yet";
  int count_ = 0;
  bool had_pose_ = false;
  bool has_ended_ = false;
  std::condition_variable changed_;
  std::vector<std::thread> threads_;
};

}  // namespace mono_pose_tracker
