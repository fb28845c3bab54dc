#pragma once

#include <utility>
#include <vector>

#include "mapping/second_motion.h"

namespace mono_pose_tracker {

// Of a camera that goes through a place: leaves out of the matches what is fixed to the camera, a bonnet or
// the words that a drone or a dashcam writes into its images, and says anew what the rest obeys. It keeps its
// place in most pairs, and in a small part of the images, though there may be many features in it: a place
// where the camera rests for a while is still in some pairs only, and a background before which something
// passes is in more of the images. Otherwise nothing is left out. pairs: places in `images`; motions: one a
// pair.
void exclude_ego_vehicle_features(const std::vector<RegisteredImage>& images,
                                  const std::vector<std::pair<int, int>>& pairs, const RansacOptions& ransac,
                                  std::vector<PairMotions>* motions);

}  // namespace mono_pose_tracker
