#include "mapping/object_watch.h"

#include <algorithm>

#include "mapping/independent_motion.h"

namespace mono_pose_tracker {

namespace {

// Fewer features than the first map must have by default (bootstrap/min_landmarks) begin none, and tell a
// turn badly: that is so for whoever has chosen another number, too.
constexpr std::ptrdiff_t kLeastMembers = 25;
// Matches that obey the map alone: where there are fewer it is the map that is astray, and nothing says where
// the rest is.
constexpr std::ptrdiff_t kLeastOfMap = 5;
// Pairs that show a second motion: one by chance in one pair in a hundred is in three never.
constexpr std::ptrdiff_t kLeastOthers = 3;
// Asked at a time. A map that was right may have gone astray; what was seen long ago does not speak for it.
constexpr std::size_t kMostPairs = 12;
// rad, a third of what it has turned: half a pixel of noise looks as much on a body of 60 px.
constexpr double kLeastRotation = 0.015;

std::shared_ptr<const TurningObject> object_in(const RegisteredImage& image, const PairMotions& pair) {
  auto object = std::make_shared<TurningObject>();
  object->image = image.image;
  object->sides.assign(image.image->size(), FeatureMotion::kUnknown);
  for (std::size_t i = 0; i < pair.matches.size(); ++i) {
    FeatureMotion& side = object->sides[pair.matches[i].second];
    if (pair.obeyed[i] == ObeyedMotion::kOther) side = FeatureMotion::kTurns;
    if (pair.obeyed[i] == ObeyedMotion::kObject) side = FeatureMotion::kMovesOtherwise;
  }
  return object;
}

}  // namespace

void ObjectWatch::note(const RegisteredImage& before, const RegisteredImage& newest,
                       const PairMotions& pair) {
  const auto members = std::count(pair.obeyed.begin(), pair.obeyed.end(), ObeyedMotion::kOther);
  const auto of_map = std::count(pair.obeyed.begin(), pair.obeyed.end(), ObeyedMotion::kObject);
  Seen seen = Seen::kOneMotion;
  if (pair.has_other && members >= kLeastMembers) {
    const double turn = rotation_between(before, newest, pair, ObeyedMotion::kObject);
    const double other_rotation = rotation_between(before, newest, pair, ObeyedMotion::kOther);
    seen = other_rotation > std::max(IndependentMotion::kPlainly * turn, kLeastRotation) ? Seen::kOtherRotates
                                                                                         : Seen::kOther;
  }
  seen_.push_back(seen);
  if (seen_.size() > kMostPairs) seen_.pop_front();
  const auto turning = std::count(seen_.begin(), seen_.end(), Seen::kOtherRotates);
  const auto others = turning + std::count(seen_.begin(), seen_.end(), Seen::kOther);
  // A body is in every fourth pair at least (IndependentMotion::exists); that it turns more must be plain in
  // most.
  const bool exists = others >= kLeastOthers && 4 * others >= static_cast<std::ptrdiff_t>(seen_.size());
  if (!exists || 4 * turning < 3 * others) {
    found_.reset();
  } else if (seen == Seen::kOtherRotates && of_map >= kLeastOfMap) {
    found_ = object_in(newest, pair);
  }
}

}  // namespace mono_pose_tracker
