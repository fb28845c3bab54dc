#pragma once

#include <utility>
#include <vector>

#include "mapping/second_motion.h"

namespace mono_pose_tracker {

// Excludes ego-vehicle features and static overlay (a bonnet, text in the images of a drone or dashcam) from
// the matches of a camera that moves through a place, and estimates the motions of the rest anew. Such
// features keep their place in most pairs and in a small part of the image, even if there are many of them.
// Where the camera rests for a while, only some pairs are still; a background behind a passing object fills
// more of the image. In both cases nothing is excluded. pairs: indices into `images`; motions: one for each
// pair.
void exclude_ego_vehicle_features(const std::vector<RegisteredImage>& images,
                                  const std::vector<std::pair<int, int>>& pairs, const RansacOptions& ransac,
                                  std::vector<PairMotions>* motions);

}  // namespace mono_pose_tracker
