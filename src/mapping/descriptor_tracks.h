#pragma once

#include <vector>

#include "feature_tracks.h"
#include "mapping/retriangulation.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

// Features of keyframes in the order of time, joined by descriptors alone, whatever the map knows: each
// keyframe matched with the eight before it, the nearest first, as they are matched most surely. The same for
// any number of threads.
FeatureTracks tracks_by_descriptors(const std::vector<const Keyframe*>& in_time, const MatchOptions& matching,
                                    const IsLeftOut& is_left_out, int threads);

}  // namespace mono_pose_tracker
