#pragma once

#include <opencv2/core.hpp>
#include <string>

namespace mono_pose_tracker {

/// The 16-bit values that become black and white in 8 bits.
struct GreyLevels {
  double black = 0, white = 65536;
};

/// Options of GreyLevelChoice.
struct GreyLevelOptions {
  int first_images = 5;        // that auto looks at, before the levels stay
  double least_bright = 256;   // a first image whose brightest value is below tells nothing: a lens cap
  int most_dark_images = 100;  // after so many of these they count as well
  double tail_share = 1e-3;    // of the pixels below and above what counts as the range of an image
  double least_range =
      1.0 / 8;          // of the values of so many bits: a narrower range is stretched (thermal cameras)
  double margin = 0.5;  // of the range, on either side: the scene changes
};

/// Chooses the grey levels of the 16-bit images of a recording or topic. setting: "auto"; a number of
/// significant bits, "8" to "16", of the lower ones; or "BLACK:WHITE", two values. auto: from the first
/// images, the smallest of 8, 10, 12, 14 and 16 bits that holds their values; if they use a small part of
/// that range, that part. Constant afterwards: brightness must not depend on the image's content.
class GreyLevelChoice {
 public:
  /// Throws std::invalid_argument on another setting, with a text that says what was expected.
  explicit GreyLevelChoice(const std::string& setting = "auto", const GreyLevelOptions& options = {});

  /// Inspects an image (CV_16UC1 to 4; other depths are ignored). True when the levels have been settled by
  /// it.
  bool look_at(const cv::Mat& image);
  bool is_settled() const { return is_settled_; }
  const GreyLevels& levels() const { return levels_; }
  /// The chosen levels and the reason, one line. Empty if no image has 16 bits.
  std::string text() const;

 private:
  void settle_by_range();

  GreyLevelOptions options_;
  GreyLevels levels_;
  std::string reason_;
  bool is_settled_ = false;
  int looked_at_ = 0, dark_ = 0;
  double lowest_ = 65535, highest_ = 0, brightest_ = 0;  // of the images looked at
};

}  // namespace mono_pose_tracker
