#pragma once

#include <deque>
#include <memory>

#include "map/turning_object.h"
#include "mapping/second_motion.h"

namespace mono_pose_tracker {

/// Watches whether a growing map is of an object that rotates less in front of the camera than another one,
/// such as the room behind a head. The same check as IndependentMotion of a finished map, on pairs of new
/// keyframes.
class ObjectWatch {
 public:
  /// Evaluates the newest keyframe against one before it.
  void note(const RegisteredImage& before, const RegisteredImage& newest, const PairMotions& pair);
  /// The other object in the newest keyframe that shows it, once it is certain; null: the mapped object
  /// rotates most.
  const std::shared_ptr<const TurningObject>& found() const { return found_; }
  void reset() { *this = ObjectWatch(); }

 private:
  enum class Seen { kOneMotion, kOther, kOtherRotates };

  std::deque<Seen> seen_;  // the latest pairs
  std::shared_ptr<const TurningObject> found_;
};

}  // namespace mono_pose_tracker
