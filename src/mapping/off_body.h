#pragma once

#include <map>
#include <vector>

#include "mapping/retriangulation.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// Features of keyframes, one flag for each.
using KeyframeFeatures = std::map<KeyframeId, std::vector<char>>;

/// What is none of the body that a finished map is of, though from one image to the next it obeys the same
/// motion: a neck and a chest below a head that turns lie about the axis of its turn, where a point of the
/// head would stand still as well; what gives them away is that they sway, a few px in the whole of the
/// recording. The features of the keyframes are joined to tracks by descriptors alone, since a map holds only
/// what agrees with it. A track is off the body that lies away from the one point that explains it best, in
/// the median of its views, by three times what is usual among the tracks, and a feature where most of the
/// tracks around it are. Nothing where that is less than a thirtieth of what the map's landmarks are seen by,
/// as wrong matches make of a map of one body (of head_real_67 one in seventy at most), or more than half:
/// then it is the poses that are in doubt. is_left_out: features that are known to be none of the body. The
/// same for any number of threads.
KeyframeFeatures features_off_body(const Map& map, const MatchOptions& matching, const IsLeftOut& is_left_out,
                                   int threads);

}  // namespace mono_pose_tracker
