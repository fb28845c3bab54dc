#include "mask_record.h"

#include <opencv2/imgcodecs.hpp>

namespace mono_pose_tracker {

void MaskRecord::add(std::int64_t index, const FrameReport& report) {
  ++frames_[report.segmentation];
  if (report.mask.empty()) return;
  share_ += cv::countNonZero(report.mask) / static_cast<double>(report.mask.total());
  ++masks_;
  if (keep_) cv::imencode(".png", report.mask, packed_[index]);
}

void MaskRecord::replace(std::int64_t index, const cv::Mat& mask) {
  cv::imencode(".png", mask, packed_[index]);
}

cv::Mat MaskRecord::mask(std::int64_t index) const {
  const auto packed = packed_.find(index);
  return packed == packed_.end() ? cv::Mat() : cv::imdecode(packed->second, cv::IMREAD_GRAYSCALE);
}

Json MaskRecord::summary() const {
  std::string method = "none";  // that most frames with a mask had
  int most = 0;
  for (const auto& [name, frames] : frames_) {
    if (name != "none" && frames > most) method = name, most = frames;
  }
  return {
      {"method", method}, {"frames", masks_}, {"mean_foreground_share", masks_ > 0 ? share_ / masks_ : 1.0}};
}

}  // namespace mono_pose_tracker
