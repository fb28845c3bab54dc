#pragma once

#include <array>
#include <opencv2/core.hpp>

namespace mono_pose_tracker {

/// Where to cut a histogram of 256 levels in two (Otsu 1979): values up to the level are the lower class.
struct OtsuCut {
  int level = 0;
  double separation =
      0;  // variance between the classes over all variance: 0.64 of one Gaussian, 1 of two spikes
};
OtsuCut otsu_cut(const std::array<double, 256>& histogram);

enum class Backdrop { kAuto, kDark, kBright };
enum class Chroma { kGreen, kBlue };

/// Raw foreground (CV_8UC1, 255) before a dark or a bright backdrop. image: CV_8UC1 or BGR. kAuto: whichever
/// the image's border mostly is. level: grey level that parts the two; negative: found.
cv::Mat threshold_foreground(const cv::Mat& image, Backdrop backdrop, double level);

/// Raw foreground before a green or blue backdrop. image: BGR; a grey one has no colour: all is foreground.
/// level: how much the backdrop's channel exceeds the others; negative: found.
cv::Mat chroma_foreground(const cv::Mat& image, Chroma chroma, double level);

}  // namespace mono_pose_tracker
