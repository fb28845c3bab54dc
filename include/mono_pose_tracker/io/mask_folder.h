#pragma once

#include <map>
#include <opencv2/core.hpp>
#include <string>

namespace mono_pose_tracker {

/// Mask images of a folder, found by the base name of the image they belong to, whatever their extension.
class MaskFolder {
 public:
  /// Throws std::runtime_error, one line, when there is no such folder or no image in it.
  explicit MaskFolder(const std::string& folder);

  /// Mask of an image (SourceImage::name): CV_8UC1 of the given size, 0 = ignore, 255 = use. Empty, with one
  /// line in *problem, when there is none, it cannot be read or it has another size.
  cv::Mat mask_of(const std::string& image_name, const cv::Size& size, std::string* problem) const;

 private:
  std::string folder_;
  std::map<std::string, std::string> path_by_base_name_;
};

}  // namespace mono_pose_tracker
