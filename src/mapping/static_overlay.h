#pragma once

#include <map>
#include <vector>

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

// px at 640 px (image_scale): what is held before the camera shakes against it, and a corner of a word that
// is written on changing ground is found beside its place.
constexpr double kSamePlacePx = 3;

// Features that stay where they are in the image, in the keyframe and in earlier ones, though these show that
// no point can: of what is fixed to the camera (a bonnet, a handlebar, a finger before the lens), or of what
// stands still behind a body that turns before a camera that does not. A feature in the place of one that is
// `known` to be of this kind is of it as well. One flag a feature; empty when there are none.
using FlaggedFeatures = std::map<KeyframeId, std::vector<char>>;
FlaggedFeatures find_static_overlay(const MapperOptions& options, const Map& map, KeyframeId newest,
                                    const FlaggedFeatures& known);

}  // namespace mono_pose_tracker
