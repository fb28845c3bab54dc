#include "mapping/motion_watch.h"

#include <algorithm>
#include <cmath>

#include "common/text.h"

namespace mono_pose_tracker {

namespace {

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

void MotionWatch::begin(const std::vector<SeenImage>& images) {
  const MotionSegmentationOptions options = options_;
  *this = MotionWatch(options);
  background_.emplace(options);
  for (const SeenImage& image : images) background_->add(image);
}

void MotionWatch::add_image(const SeenImage& newest, bool object_turns) {
  if (!background_) return;
  background_->add(newest);
  moving_.reset();
  if (background_->size() < options_.first_keyframes) return;
  const StaticBackground found = background_->find(options_.plainly_static, object_turns);
  if (found.exists && (object_turns || found.reaches_round)) {
    const std::vector<FeatureMotion>& sides = found.sides.back();
    if (std::count(sides.begin(), sides.end(), FeatureMotion::kTurns) >= options_.min_features &&
        std::count(sides.begin(), sides.end(), FeatureMotion::kMovesOtherwise) >=
            options_.min_static_features)
      moving_ = std::make_shared<const TurningObject>(TurningObject{newest.image, sides});
  }
  if (background_->size() >= options_.last_keyframes) background_.reset();
}

void MotionWatch::add_pair(const RegisteredImage& before, const RegisteredImage& newest,
                           const PairMotions& pair, bool object_turns) {
  MotionEvidence now = evidence_of(before, newest, pair, options_);
  if (now.of_other < options_.min_features) {
    const long of_map = now.of_map;
    now = MotionEvidence();
    now.pairs = 1, now.of_map = of_map;
  }
  newest_.push_back(now);
  if (static_cast<int>(newest_.size()) > options_.newest_pairs) newest_.pop_front();
  MotionEvidence all;
  for (const MotionEvidence& evidence : newest_) all += evidence;
  const bool exists = all.exists(options_) && all.other_pairs >= options_.min_pairs;
  other_share_ = exists && !object_turns && all.is_larger(options_) ? all.share() : 0;
  if (!exists || !object_turns || !all.rotates_plainly_more(options_)) {
    turning_.reset();
  } else if (now.rotates_plainly_more(options_) && now.other_rotation > options_.least_rotation) {
    turning_ = object_in(newest, pair);
  }
}

std::string MotionWatch::doubt() const {
  if (moving_) return "the map contains both a moving object and the static background";
  if (turning_) return "the map is of an object that rotates less than another object in view";
  if (other_share_ == 0) return "";
  return formatted("%ld %% of the points move as one rigid object, but not with the map",
                   std::lround(100 * other_share_));
}

}  // namespace mono_pose_tracker
