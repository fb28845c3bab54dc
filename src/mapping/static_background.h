#pragma once

#include <vector>

#include "map/turning_object.h"
#include "mapping/independent_motion.h"
#include "mapping/matches_in_time.h"

namespace mono_pose_tracker {

/// Features that keep their pixel in the images of a recording while other features move: the room behind a
/// head that rotates in front of a fixed camera. The moving object is then the one to be mapped.
struct StaticBackground {
  bool exists = false;
  bool reaches_round = false;  // around the moving features in most images: it is no ego-vehicle structure
  std::vector<MotionTrack> tracks;  // between consecutive images; is_other: of the moving object
  std::vector<std::vector<FeatureMotion>> sides;  // of each image's features; kTurns: moving object
};

/// Limits for a static background: median number of features that keep their place between neighbouring
/// images, and their share of the matches. A rigid scene in front of a moving camera has none or two.
struct LeastStill {
  double features = 0, share = 0;
};
/// A background is certain.
constexpr LeastStill kPlainlyStill{12, 0.08};
/// Masking the static features is worth a try where a result is in doubt: only the shirt of a head before a
/// bright, noisy wall, for example.
constexpr LeastStill kFaintlyStill{5, 0.04};

/// images: in the order of time. Each is matched with near and distant ones, and features are tested for a
/// constant pixel. Ego-vehicle features are no background: the view reaches around them (not tested where
/// object_turns: the object is known to be in front of the camera). in_time: matches of each image with the
/// next. The result is the same for any number of threads.
StaticBackground find_static_background(const std::vector<SeenImage>& images, const MatchesInTime& in_time,
                                        const MatchOptions& matching, const LeastStill& least,
                                        bool object_turns, int threads);

}  // namespace mono_pose_tracker
