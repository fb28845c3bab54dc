#include "segmentation/backdrop.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "reduced_image.h"

namespace mono_pose_tracker {

namespace {

using Histogram = std::array<double, 256>;

Histogram histogram_of(const cv::Mat& gray) {
  Histogram histogram{};
  for (int y = 0; y < gray.rows; ++y) {
    const auto* row = gray.ptr<std::uint8_t>(y);
    for (int x = 0; x < gray.cols; ++x) ++histogram[row[x]];
  }
  return histogram;
}

// Share of the pixels of the image's border up to a level; objects touch one side of it, rarely two.
double border_share_up_to(const cv::Mat& gray, int level) {
  double below = 0, all = 0;
  for (int y = 0; y < gray.rows; ++y) {
    const bool whole_row = y == 0 || y == gray.rows - 1;
    for (int x = 0; x < gray.cols; x += whole_row ? 1 : std::max(gray.cols - 1, 1)) {
      below += gray.at<std::uint8_t>(y, x) <= level;
      ++all;
    }
  }
  return below / all;
}

// Level above a dark backdrop. An object with dark and bright parts makes three classes, and Otsu's cut may
// separate the wrong two: the lower class is split again as long as it has two classes and the darker one
// covers most of the border.
int level_above_dark(const cv::Mat& gray) {
  constexpr double kTwoClasses = 0.8;  // separation; one Gaussian has 0.64, an even spread 0.75
  constexpr double kMostOfBorder = 0.5;
  constexpr double kMinShare =
      0.04;  // of the image: the rim where the object blurs into the backdrop has less
  Histogram histogram = histogram_of(gray);
  int level = otsu_cut(histogram).level;
  for (int i = 0; i < 2; ++i) {
    std::fill(histogram.begin() + level + 1, histogram.end(), 0.0);
    const OtsuCut next = otsu_cut(histogram);
    const double between = std::accumulate(histogram.begin() + next.level + 1, histogram.end(), 0.0);
    if (next.separation < kTwoClasses || between < kMinShare * static_cast<double>(gray.total()) ||
        border_share_up_to(gray, next.level) < kMostOfBorder) {
      break;
    }
    level = next.level;
  }
  return level;
}

// Smoothed: noise would widen the classes, and specks do not affect the level.
cv::Mat smoothed(const cv::Mat& gray) {
  cv::Mat smooth;
  cv::GaussianBlur(gray, smooth, {5, 5}, 0);
  return smooth;
}

}  // namespace

OtsuCut otsu_cut(const std::array<double, 256>& histogram) {
  double count = 0, sum = 0, square_sum = 0;
  for (int i = 0; i < 256; ++i) {
    count += histogram[i];
    sum += i * histogram[i];
    square_sum += static_cast<double>(i) * i * histogram[i];
  }
  OtsuCut cut;
  if (count == 0) return cut;
  const double variance = square_sum / count - (sum / count) * (sum / count);
  double below = 0, below_sum = 0;
  for (int i = 0; i < 255; ++i) {
    below += histogram[i];
    below_sum += i * histogram[i];
    const double above = count - below;
    if (below == 0 || above == 0) continue;
    const double apart = below_sum / below - (sum - below_sum) / above;
    const double between = below * above * apart * apart / (count * count);
    if (variance > 0 && between / variance > cut.separation) cut = {i, between / variance};
  }
  return cut;
}

cv::Mat threshold_foreground(const cv::Mat& image, Backdrop backdrop, double level) {
  const cv::Mat gray = smoothed(gray_of(image));
  if (backdrop == Backdrop::kAuto) {
    const int cut = level >= 0 ? static_cast<int>(level) : otsu_cut(histogram_of(gray)).level;
    backdrop = border_share_up_to(gray, cut) >= 0.5 ? Backdrop::kDark : Backdrop::kBright;
  }
  if (backdrop == Backdrop::kDark) return gray > (level >= 0 ? level : level_above_dark(gray));
  if (level >= 0) return gray <= level;
  const cv::Mat inverted = 255 - gray;
  return inverted > level_above_dark(inverted);
}

cv::Mat chroma_foreground(const cv::Mat& image, Chroma chroma, double level) {
  if (image.channels() != 3) return cv::Mat(image.size(), CV_8UC1, cv::Scalar(255));
  cv::Mat bgr[3];
  cv::split(image, bgr);
  const int backdrop = chroma == Chroma::kBlue ? 0 : 1;
  cv::Mat others, excess;
  cv::max(bgr[1 - backdrop], bgr[2], others);
  cv::subtract(bgr[backdrop], others, excess);  // saturates at 0
  excess = smoothed(excess);
  return excess <= (level >= 0 ? level : otsu_cut(histogram_of(excess)).level);
}

}  // namespace mono_pose_tracker
