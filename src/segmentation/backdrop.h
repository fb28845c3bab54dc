#pragma once

#include <array>
#include <opencv2/core.hpp>

namespace mono_pose_tracker {

/// Threshold that splits a histogram of 256 levels in two (Otsu 1979): the level belongs to the lower class.
struct OtsuCut {
  int level = 0;
  double separation =
      0;  // variance between the classes over all variance: 0.64 of one Gaussian, 1 of two spikes
};
OtsuCut otsu_cut(const std::array<double, 256>& histogram);

enum class Backdrop { kAuto, kDark, kBright };
enum class Chroma { kGreen, kBlue };

/// Raw foreground (CV_8UC1, 255) in front of a dark or bright backdrop. image: CV_8UC1 or BGR. kAuto: decided
/// by the image's border. level: grey level of the split; negative: found.
cv::Mat threshold_foreground(const cv::Mat& image, Backdrop backdrop, double level);

/// Raw foreground in front of a green or blue backdrop. image: BGR; in a grey image everything is foreground.
/// level: excess of the backdrop's channel over the others; negative: found.
cv::Mat chroma_foreground(const cv::Mat& image, Chroma chroma, double level);

}  // namespace mono_pose_tracker
