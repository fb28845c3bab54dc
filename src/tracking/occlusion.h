#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

// Where a landmark should be seen, and whether it was.
struct ExpectedLandmark {
  Eigen::Vector2d pixel;
  bool found = false;
};

// Which features a map of the object may grow by, one flag each: those near landmarks that were found. Where
// landmarks should be seen and hardly any is, something else is before the object; and what is far from all
// that were found may be anything that the mask took in with it.
std::vector<char> features_to_map(const ImageFeatures& image, const std::vector<ExpectedLandmark>& landmarks,
                                  int image_width);

}  // namespace mono_pose_tracker
