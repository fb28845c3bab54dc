#pragma once

#include <opencv2/core/utility.hpp>

namespace mono_pose_tracker {

/// Splits [0, size) into `threads` even parts and calls function(part, begin, end) for each, at most
/// `threads` at once (on OpenCV's pool, which cv::setNumThreads limits as well).
template <typename Function>
void for_parts(int size, int threads, const Function& function) {
  const auto begin_of = [&](int part) {
    return static_cast<int>(static_cast<long long>(size) * part / threads);
  };
  if (threads == 1) {
    function(0, 0, size);
    return;
  }
  cv::parallel_for_(
      cv::Range(0, threads),
      [&](const cv::Range& parts) {
        for (int part = parts.start; part < parts.end; ++part)
          function(part, begin_of(part), begin_of(part + 1));
      },
      threads);
}

}  // namespace mono_pose_tracker
