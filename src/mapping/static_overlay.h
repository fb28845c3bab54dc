#pragma once

#include <map>
#include <vector>

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

// px at 640 px (image_scale). Something held in front of the camera shakes against it, and a corner of
// overlaid text on a changing background is detected off its place.
constexpr double kSamePlacePx = 3;

// Finds features of the keyframe that keep their pixel since earlier keyframes though no landmark could. They
// are static overlay, ego-vehicle features (a bonnet, a handlebar, a finger before the lens) or a static
// background behind an object that rotates before a fixed camera. A feature at the pixel of a `known` one
// counts as well. One flag for each feature; empty when there are none.
using FlaggedFeatures = std::map<KeyframeId, std::vector<char>>;
FlaggedFeatures find_static_overlay(const MapperOptions& options, const Map& map, KeyframeId newest,
                                    const FlaggedFeatures& known);

}  // namespace mono_pose_tracker
