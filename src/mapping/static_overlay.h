#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

struct StaticOverlayOptions {
  // px at 640 px (image_scale). Something held in front of the camera shakes against it, and a corner of
  // overlaid text on a changing background is detected off its place.
  double same_place_px = 3;
  // px at 640 px (image_scale), median over the views: twice an inlier's error. Landmarks that keep their
  // pixel within 3 px because the camera hardly moves, keeps them centred or drives straight at them have
  // only their noise.
  double no_point_px = 4;
  // Earlier keyframes with a feature at the same pixel, minimum number and share: repeated patterns (tiles, a
  // carpet) have similar features at one pixel now and then. With two keyframes the rays would often
  // intersect.
  std::size_t min_earlier = 3;
  double min_earlier_share = 0.5;
  int min_features = 12;          // in the newest keyframe: one or two are fixed by chance
  std::size_t max_compared = 12;  // earlier keyframes
};

using FlaggedFeatures = std::map<KeyframeId, std::vector<char>>;  // by keyframe: one flag for each feature

inline bool is_flagged(const FlaggedFeatures& features, KeyframeId id, int feature) {
  const auto found = features.find(id);
  return found != features.end() && found->second[feature] != 0;
}

// Finds features of the keyframe that keep their pixel since earlier keyframes though no landmark could. They
// are static overlay, ego-vehicle features (a bonnet, a handlebar, a finger before the lens) or a static
// background behind an object that rotates before a fixed camera. A feature at the pixel of a `known` one
// counts as well. Empty when there are none.
FlaggedFeatures find_static_overlay(const MapperOptions& options, const Map& map, KeyframeId newest,
                                    const FlaggedFeatures& known);

}  // namespace mono_pose_tracker
