#pragma once

#include <deque>
#include <memory>

#include "map/turning_object.h"
#include "mapping/second_motion.h"

namespace mono_pose_tracker {

/// Whether a map that is being made is of a body that turns less before the camera than another: of the room
/// behind a head, say. The same that IndependentMotion asks of a finished map, of the pairs of keyframes as
/// they come.
class ObjectWatch {
 public:
  /// What the newest keyframe and one before it show.
  void note(const RegisteredImage& before, const RegisteredImage& newest, const PairMotions& pair);
  /// The other body in the newest keyframe that showed it, once it is certain; null: the map is of what turns
  /// most.
  const std::shared_ptr<const TurningObject>& found() const { return found_; }
  void reset() { *this = ObjectWatch(); }

 private:
  enum class Seen { kOneMotion, kOther, kOtherRotates };

  std::deque<Seen> seen_;  // in the latest pairs
  std::shared_ptr<const TurningObject> found_;
};

}  // namespace mono_pose_tracker
