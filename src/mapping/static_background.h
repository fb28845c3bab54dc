#pragma once

#include <vector>

#include "map/turning_object.h"
#include "mapping/independent_motion.h"
#include "mapping/matches_in_time.h"

namespace mono_pose_tracker {

/// What keeps its place in the images of a recording while other things move: the room behind a head that
/// turns before a fixed camera. Whatever a map of such images is of, what moves is what was meant.
struct StaticBackground {
  bool exists = false;
  bool reaches_round = false;  // what moves in most images, so that it is not fixed to the camera for certain
  std::vector<MotionTrack> tracks;  // between images that follow each other; is_other: of what moves
  std::vector<std::vector<FeatureMotion>> sides;  // of each image's features: what turns is what moves
};

/// So many features must keep their place between neighbours, in the median, and such a share of the matches.
/// Of a rigid scene that a camera moves in none or two do.
struct LeastStill {
  double features = 0, share = 0;
};
/// That a background is there, whatever else is known.
constexpr LeastStill kPlainlyStill{12, 0.08};
/// That it is worth leaving out what stands still where a result is in doubt: of a head before a bright wall
/// under noise, the shirt alone.
constexpr LeastStill kFaintlyStill{5, 0.04};

/// images: in the order of time. They are matched with others near by and far off, and what matters is
/// whether the features keep their places. What is fixed to a camera that moves is no background: the view
/// reaches round it (not asked where object_turns: there an object is before the camera). in_time: matches of
/// each image with the next. The result is the same for any number of threads.
StaticBackground find_static_background(const std::vector<SeenImage>& images, const MatchesInTime& in_time,
                                        const MatchOptions& matching, const LeastStill& least,
                                        bool object_turns, int threads);

}  // namespace mono_pose_tracker
