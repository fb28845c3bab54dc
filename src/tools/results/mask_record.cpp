#include "mask_record.h"

#include <opencv2/imgcodecs.hpp>

namespace mono_pose_tracker {

void MaskRecord::add(std::int64_t index, const FrameReport& report) {
  methods_[index] = report.segmentation;
  if (!report.mask.empty()) replace(index, report.mask);
}

void MaskRecord::replace(std::int64_t index, const cv::Mat& mask) {
  shares_[index] = cv::countNonZero(mask) / static_cast<double>(mask.total());
  if (keep_) cv::imencode(".png", mask, packed_[index]);
}

cv::Mat MaskRecord::mask(std::int64_t index) const {
  const auto packed = packed_.find(index);
  return packed == packed_.end() ? cv::Mat() : cv::imdecode(packed->second, cv::IMREAD_GRAYSCALE);
}

Json MaskRecord::summary() const {
  std::map<std::string, int> frames;
  for (const auto& [index, name] : methods_) ++frames[name];
  std::string method = "none";  // that most frames with a mask had
  int most = 0;
  for (const auto& [name, count] : frames) {
    if (name != "none" && count > most) method = name, most = count;
  }
  double sum = 0;
  for (const auto& [index, share] : shares_) sum += share;
  const auto count = static_cast<double>(shares_.size());
  return {{"method", method},
          {"frames", shares_.size()},
          {"mean_foreground_share", shares_.empty() ? 1.0 : sum / count}};
}

}  // namespace mono_pose_tracker
