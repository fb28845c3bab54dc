#pragma once

#include <map>
#include <opencv2/core.hpp>
#include <string>

namespace mono_pose_tracker {

/// Mask images of a folder and of the folders in it, found by the name of the image they belong to, whatever
/// their extension.
class MaskFolder {
 public:
  /// Throws std::runtime_error, one line, when there is no such folder or no image in it.
  explicit MaskFolder(const std::string& folder);

  /// Mask of an image (SourceImage::mask_name; its folders count where the masks lie in folders): CV_8UC1 of
  /// the given size, 0 = ignore, 255 = use. Empty, with one line in *problem, when there is none, it cannot
  /// be read or it has another size.
  cv::Mat mask_of(const std::string& mask_name, const cv::Size& size, std::string* problem) const;

  /// True when no mask lies in a folder of its own: images of several folders share those of their name.
  bool is_flat() const { return is_flat_; }

 private:
  std::string folder_;
  bool is_flat_ = true;
  std::map<std::string, std::string> path_by_name_;  // by the path below folder_, without its extension
};

}  // namespace mono_pose_tracker
