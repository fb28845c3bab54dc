#pragma once

#include <cstddef>
#include <set>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

struct MotionPriorOptions {
  double significance = 1e-3;    // expected false alarms a recording, where the prior holds; in (0, 1)
  double max_path_sigma = 0.01;  // share of the path, as in QualityOptions. Deviations up to three of it are
                                 // within what a known path may be off
  std::size_t fewest = 10;       // accelerations from which their variance is estimated
};

/// Keyframes whose positions contradict the motion before as well as the motion after them, which agree with
/// each other without these: single ones or two in a row. The camera is expected to keep its velocity; its
/// acceleration is white noise with the variance that the recording shows (the median, for a hand as for a
/// car), and the gate is the tail of the chi-square distribution of three degrees of freedom, corrected for
/// the number of keyframes (Bonferroni). A corner, a stop or another place contradicts the motion on one
/// side, or is part of the motion of the others. Keyframes of earlier runs are not judged.
///
/// Motions can be like that. The landmarks that such a keyframe has helped to triangulate say nothing about
/// it: its position is to be found again by the others.
std::set<KeyframeId> off_motion(const Map& map);

}  // namespace mono_pose_tracker
