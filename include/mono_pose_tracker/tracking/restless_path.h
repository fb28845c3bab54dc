#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

/// A stretch of a trajectory in which the camera jumps to and fro, from image to image: places that look
/// alike, such as the doors of a corridor, were taken for each other.
struct RestlessPath {
  std::int64_t frame_index = -1;  // where the stretch begins; -1: there is none
  int jumps = 0;                  // in it

  static constexpr int kFrames = 20;  // of a stretch
  /// A camera in the hand that rests now and then jumps four times at most by this measure, in recordings
  /// whose truth is known; the paths that are wrong six to eleven times.
  static constexpr int kMostOfARightPath = 5;
  bool is_significant() const { return jumps > kMostOfARightPath; }
};

/// Frames whose images agree with their step from the frame before; true: and would not with none, so that
/// they show it.
using SeenSteps = std::map<std::int64_t, bool>;

/// The worst one. At a jump the velocity changes, from one image in a row to the next, by three times the
/// usual step (in a video that holds each image again, of those between which the camera moves; a camera that
/// turns back on the spot changes it by two), and by `least`, in the map's unit, which a camera that hardly
/// moves does not; and with the very next image it changes the other way. A head that is shaken after it was
/// still takes several images to turn back.
/// Between two steps that the images themselves agree with there is no jump, if they show one of them.
RestlessPath most_restless_stretch(const std::vector<PosedFrame>& trajectory, double least,
                                   const SeenSteps& seen);

/// The greatest change of velocity between images that follow each other, over what nine of ten of them stay
/// below; 0 of fewer than ten. Of walks whose truth is known 4.4 at most; where a part of one is put beside
/// its place 6 to 14. (A turntable that is turned by hand may go on by a step of 7.)
double greatest_leap(const std::vector<PosedFrame>& trajectory);

/// Those at the jumps of stretches that have more than a right path has, and before and after them.
std::set<std::int64_t> frames_at_jumps(const std::vector<PosedFrame>& trajectory, double least);

}  // namespace mono_pose_tracker
