#include "mapping/static_background_watch.h"

#include <algorithm>
#include <cstddef>

namespace mono_pose_tracker {

namespace {

// With fewer images, slow features are taken for static ones, and the next map begins with the wrong
// features. By the twelfth image the object has moved far enough to be separated.
constexpr std::size_t kFewest = 9, kMost = 12;
// Features of the newest image: fewer moving ones begin no map by default (bootstrap/min_landmarks; with a
// higher option the next map only waits for a better image), and fewer static ones do not delimit the object.
constexpr std::ptrdiff_t kLeastMoving = 25, kLeastStill = 5;

}  // namespace

void StaticBackgroundWatch::begin(const std::vector<SeenImage>& views, const MatchOptions& matching) {
  reset();
  watches_ = true;
  for (const SeenImage& view : views) add(view, matching);
}

void StaticBackgroundWatch::add(const SeenImage& image, const MatchOptions& matching) {
  if (!images_.empty()) {
    in_time_.push_back(
        match_descriptors(images_.back().image->set.descriptors, image.image->set.descriptors, matching));
  }
  images_.push_back(image);
}

void StaticBackgroundWatch::note(const SeenImage& newest, const MatchOptions& matching, bool object_turns) {
  if (!watches_) return;
  add(newest, matching);
  found_.reset();
  if (images_.size() < kFewest) return;
  const StaticBackground background =
      find_static_background(images_, in_time_, matching, kPlainlyStill, object_turns, 1);
  if (background.exists && (object_turns || background.reaches_round)) {
    const std::vector<FeatureMotion>& sides = background.sides.back();
    if (std::count(sides.begin(), sides.end(), FeatureMotion::kTurns) >= kLeastMoving &&
        std::count(sides.begin(), sides.end(), FeatureMotion::kMovesOtherwise) >= kLeastStill) {
      found_ = std::make_shared<const TurningObject>(TurningObject{newest.image, sides});
    }
  }
  if (images_.size() < kMost) return;
  watches_ = false;
  images_.clear();
  in_time_.clear();
}

}  // namespace mono_pose_tracker
