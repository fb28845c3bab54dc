#include "mapping/map_motions.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/text.h"
#include "keyframe_landmarks.h"
#include "mapping/in_view.h"

namespace mono_pose_tracker {

namespace {

// Whether the features observe more than half of the keyframe's landmarks: then the pose is in doubt rather
// than the features.
bool is_most_of(const Keyframe& keyframe, const std::vector<char>& features) {
  int all = 0, flagged = 0;
  for (std::size_t f = 0; f < features.size(); ++f) {
    if (keyframe.landmark_of_feature[f] == kNoLandmark) continue;
    ++all;
    flagged += features[f] != 0;
  }
  return 2 * flagged > all;
}

MotionSegmentationOptions motion_options(const MapperOptions& options) {
  return motion_segmentation_options(options.matching, options.ransac, 1);
}

}  // namespace

MapMotions::MapMotions(const MapperOptions& options) : watch_(motion_options(options)) {}

void MapMotions::begin(const MapperOptions& options, const InitialMap& initial) {
  if (!options.tells_background) return;
  std::vector<SeenImage> images;
  for (const InitialMap::View& view : initial.views) {
    if (view.frame.is_masked) return;
    images.push_back({view.frame.index, view.frame.image});
  }
  watch_.begin(images);
}

void MapMotions::add(KeyframeId id, const Frame& frame) {
  if (frame.unmasked) unmasked_[id] = frame.unmasked;
}

void MapMotions::remove(KeyframeId id) {
  excluded_.erase(id);
  unmasked_.erase(id);
}

void MapMotions::separate(const MapperOptions& options, int partners, KeyframeId id, Map* map) {
  if (!options.separates_motions) return;
  std::vector<KeyframeId> compared = neighbors(*map, id, partners);
  const auto place = map->keyframes().find(id);
  if (place != map->keyframes().begin()) {
    const KeyframeId previous = std::prev(place)->first;
    if (std::find(compared.begin(), compared.end(), previous) == compared.end()) compared.push_back(previous);
  }
  for (const KeyframeId partner : compared) {
    if (options.bundle.is_cancelled()) return;
    const Keyframe &first = *map->keyframe(partner), &second = *map->keyframe(id);
    const RegisteredImage before = registered_image(first), newest = registered_image(second);
    const PairMotions pair = compare_motions(before, newest, motion_options(options));
    // Each pair once; the first views of a map are compared with later ones as well.
    if (options.is_live && partner < id) watch_pair(options, first, second, &pair);
    const SecondMotion other = second_motion_in(pair, *before.image, *newest.image);
    if (other.of_first.empty() || is_most_of(first, other.of_first)) continue;
    exclude(partner, other.of_first, map);
    exclude(id, other.of_second, map);
  }
}

void MapMotions::exclude_static_overlay(const MapperOptions& options, KeyframeId id, Map* map) {
  for (const auto& [keyframe, features] : find_static_overlay(options, *map, id, excluded_))
    exclude(keyframe, features, map);
}

void MapMotions::exclude(KeyframeId id, const std::vector<char>& features, Map* map) {
  std::vector<char>& excluded = excluded_[id];
  excluded.resize(features.size(), 0);
  for (std::size_t f = 0; f < features.size(); ++f) {
    if (!features[f]) continue;
    excluded[f] = 1;
    const LandmarkId l = map->keyframe(id)->landmark_of_feature[f];
    if (l != kNoLandmark) map->remove_landmark(l);
  }
}

void MapMotions::watch_background(const MapperOptions& options, const Frame& newest, const Map& map,
                                  StageTimes* stages) {
  if (newest.is_masked) watch_.end_background();
  if (!watch_.checks_background() || options.bundle.is_cancelled()) return;
  const StageTimer timer(*stages, "map_background");
  watch_.add_image({newest.index, newest.image}, options.separates_motions);
  // Static features of a camera that moves through a place are ego-vehicle features.
  if (watch_.object() && !options.separates_motions && !stays_in_view(map)) watch_.end_background();
}

void MapMotions::watch_object(const MapperOptions& options, const Map& map) {
  if (!options.is_live || options.separates_motions || map.keyframes().size() < 2) return;
  const auto newest = std::prev(map.keyframes().end());
  watch_pair(options, std::prev(newest)->second, newest->second, nullptr);
}

// Compares the newest keyframe with one before it. Where the object that rotates is wanted, the unmasked
// features are compared, including those excluded as another object's: the wrong object may have been
// excluded. known: the motions of the masked features; null: unknown.
void MapMotions::watch_pair(const MapperOptions& options, const Keyframe& before, const Keyframe& newest,
                            const PairMotions* known) {
  RegisteredImage first = registered_image(before), second = registered_image(newest);
  const auto of_first = unmasked_.find(before.id), of_second = unmasked_.find(newest.id);
  if (options.separates_motions && of_first != unmasked_.end() && of_second != unmasked_.end()) {
    first.image = of_first->second;
    second.image = of_second->second;
    known = nullptr;
  }
  watch_.add_pair(first, second, known ? *known : compare_motions(first, second, motion_options(options)),
                  options.separates_motions);
}

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
