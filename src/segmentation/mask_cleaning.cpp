#include "segmentation/mask_cleaning.h"

#include <algorithm>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace mono_pose_tracker {

namespace {

cv::Mat disc(int radius) {
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * radius + 1, 2 * radius + 1});
}

// The largest components, with their holes filled.
cv::Mat largest_filled(const cv::Mat& mask, int objects, double min_area_px) {
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(mask, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  std::vector<std::pair<double, int>> by_area;
  for (std::size_t i = 0; i < contours.size(); ++i) {
    // A contour runs through the outer pixels' centres: half a pixel is outside it all round.
    const double area = cv::contourArea(contours[i]) + 0.5 * static_cast<double>(contours[i].size()) + 1;
    if (area >= min_area_px) by_area.emplace_back(-area, static_cast<int>(i));
  }
  std::sort(by_area.begin(), by_area.end());
  if (static_cast<int>(by_area.size()) > objects) by_area.resize(objects);
  cv::Mat kept = cv::Mat::zeros(mask.size(), CV_8UC1);
  for (const auto& entry : by_area) cv::drawContours(kept, contours, entry.second, 255, cv::FILLED);
  return kept;
}

}  // namespace

void fill_holes(cv::Mat* mask) {
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(*mask, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  cv::drawContours(*mask, contours, -1, 255, cv::FILLED);
}

cv::Mat clean_mask(const cv::Mat& raw, int opening_radius, int closing_radius, int objects,
                   double min_area_px) {
  // The border is replicated: objects often extend beyond the image.
  const int pad = std::max(opening_radius, closing_radius) + 1;
  cv::Mat mask;
  cv::copyMakeBorder(raw, mask, pad, pad, pad, pad, cv::BORDER_REPLICATE);
  if (opening_radius > 0) cv::morphologyEx(mask, mask, cv::MORPH_OPEN, disc(opening_radius));
  if (closing_radius > 0) cv::morphologyEx(mask, mask, cv::MORPH_CLOSE, disc(closing_radius));
  mask = mask(cv::Rect(pad, pad, raw.cols, raw.rows)).clone();
  return largest_filled(mask, objects, min_area_px);
}

cv::Mat clearance_of(const cv::Mat& mask, double margin_px, double margin_scales, int scale_steps) {
  cv::Mat distance;
  cv::distanceTransform(mask, distance, cv::DIST_L2, cv::DIST_MASK_3);
  cv::Mat clearance(mask.size(), CV_8UC1);
  const auto steps = static_cast<float>(scale_steps / std::max(margin_scales, 1e-3));
  const auto margin = static_cast<float>(margin_px);
  for (int y = 0; y < mask.rows; ++y) {
    const float* d = distance.ptr<float>(y);
    auto* c = clearance.ptr<std::uint8_t>(y);
    for (int x = 0; x < mask.cols; ++x) {
      const float room = d[x] - margin;  // px; distances count from the centre of the nearest pixel outside
      c[x] = room <= 0 ? 0 : static_cast<std::uint8_t>(std::min(255.f, room * steps + 0.5f));
    }
  }
  return clearance;
}

}  // namespace mono_pose_tracker
