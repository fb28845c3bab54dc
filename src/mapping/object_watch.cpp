#include "mapping/object_watch.h"

#include <algorithm>

#include "mapping/independent_motion.h"

namespace mono_pose_tracker {

namespace {

// Fewer features than a first map needs by default (bootstrap/min_landmarks) begin no map and determine a
// rotation badly, whatever that option is.
constexpr std::ptrdiff_t kLeastMembers = 25;
// Minimum of matches that obey only the map: with fewer, the map itself is misregistered, and the other
// motion is unknown.
constexpr std::ptrdiff_t kLeastOfMap = 5;
// Pairs that show a second motion: accidental in one pair of a hundred, never in three.
constexpr std::ptrdiff_t kLeastOthers = 3;
// Number of latest pairs that are evaluated. A right map may become misregistered later, so older pairs do
// not count.
constexpr std::size_t kMostPairs = 12;
// rad, a third of the rotation: noise of half a pixel has this effect on an object of 60 px.
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
  // An object shows in at least every fourth pair (IndependentMotion::exists); that it rotates more must be
  // plain in most of them.
  const bool exists = others >= kLeastOthers && 4 * others >= static_cast<std::ptrdiff_t>(seen_.size());
  if (!exists || 4 * turning < 3 * others) {
    found_.reset();
  } else if (seen == Seen::kOtherRotates && of_map >= kLeastOfMap) {
    found_ = object_in(newest, pair);
  }
}

}  // namespace mono_pose_tracker
