#pragma once

#include <opencv2/core/utils/logger.hpp>

namespace mono_pose_tracker {

/// OpenCV logs nothing while an object of this class lives: it would log each backend that cannot open a
/// video, though the next one may, and the caller reports the failure in its own words.
class QuietOpenCv {
 public:
  QuietOpenCv() : level_(cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT)) {}
  ~QuietOpenCv() { cv::utils::logging::setLogLevel(level_); }
  QuietOpenCv(const QuietOpenCv&) = delete;
  QuietOpenCv& operator=(const QuietOpenCv&) = delete;

 private:
  cv::utils::logging::LogLevel level_;
};

}  // namespace mono_pose_tracker
