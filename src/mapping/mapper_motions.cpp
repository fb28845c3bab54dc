// The part of the Mapper that excludes independently moving features, watches other motions, and reports
// inconsistencies.

#include <algorithm>
#include <iterator>

#include "keyframe_landmarks.h"
#include "mapping/in_view.h"
#include "mapping/mapper.h"
#include "mapping/motion_segmentation.h"
#include "optimization/map_adjustment.h"
#include "static_overlay.h"

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

}  // namespace

// Excludes features with a common motion other than the mapped object's, in the keyframe and one before it,
// now and later.
void Mapper::separate_motions(KeyframeId id) {
  if (!options_.separates_motions) return;
  std::vector<KeyframeId> partners = neighbors(id, limits_.motion_partners);
  const auto place = map_.keyframes().find(id);
  if (place != map_.keyframes().begin()) {
    const KeyframeId previous = std::prev(place)->first;
    if (std::find(partners.begin(), partners.end(), previous) == partners.end()) partners.push_back(previous);
  }
  for (const KeyframeId partner : partners) {
    if (is_cancelled()) return;
    const RegisteredImage before = registered_image(*map_.keyframe(partner)),
                          newest = registered_image(*map_.keyframe(id));
    const PairMotions pair = compare_motions(before, newest, motion_options());
    // Each pair once; the first views of a map are compared with later ones as well.
    if (options_.watches_motions && partner < id) watch_pair(partner, id, &pair);
    const SecondMotion other = second_motion_in(pair, *before.image, *newest.image);
    if (other.of_first.empty() || is_most_of(*map_.keyframe(partner), other.of_first)) continue;
    exclude(partner, other.of_first);
    exclude(id, other.of_second);
  }
}

// Excludes static overlay, even where it fits consecutive keyframes.
void Mapper::exclude_static_overlay(KeyframeId id) {
  for (const auto& [keyframe, features] :
       find_static_overlay(options_, map_, id, map_state_.excluded, limits_.overlay))
    exclude(keyframe, features);
}

// Flags of static overlay are lost when maps are merged or switched.
void Mapper::exclude_static_overlay() {
  for (const auto& entry : map_.keyframes()) exclude_static_overlay(entry.first);
}

MotionSegmentationOptions Mapper::motion_options() const {
  return motion_segmentation_options(options_.matching, options_.ransac, 1);
}

void Mapper::watch_static_background(const KeyframeCandidate& candidate) {
  MotionWatch& watch = map_state_.watch;
  if (candidate.frame.is_masked) watch.end_background();
  if (!watch.checks_background() || is_cancelled()) return;
  const StageTimer timer(stages_, "map_background");
  watch.add_image({candidate.frame.index, candidate.frame.image}, options_.separates_motions);
  // Static features of a camera that moves through a place are ego-vehicle features.
  if (watch.object() && !options_.separates_motions && !stays_in_view(map_)) watch.end_background();
}

// Where a mask excludes the static features there is nothing to separate.
void Mapper::watch_static_background(const InitialMap& initial) {
  if (!options_.tells_background) return;
  std::vector<SeenImage> images;
  for (const InitialMap::View& view : initial.views) {
    if (view.frame.is_masked) return;
    images.push_back({view.frame.index, view.frame.image});
  }
  map_state_.watch.begin(images);
}

// Compares the newest keyframe with one before it. Where the object that rotates is wanted, the unmasked
// features are compared, including those excluded as another object's: the wrong object may have been
// excluded. known: the motions of the masked features; null: unknown.
void Mapper::watch_pair(KeyframeId before_id, KeyframeId newest_id, const PairMotions* known) {
  RegisteredImage before = registered_image(*map_.keyframe(before_id)),
                  newest = registered_image(*map_.keyframe(newest_id));
  const auto unmasked_before = map_state_.unmasked.find(before_id),
             unmasked_newest = map_state_.unmasked.find(newest_id);
  if (options_.separates_motions && unmasked_before != map_state_.unmasked.end() &&
      unmasked_newest != map_state_.unmasked.end()) {
    before.image = unmasked_before->second;
    newest.image = unmasked_newest->second;
    known = nullptr;
  }
  map_state_.watch.add_pair(before, newest,
                            known ? *known : compare_motions(before, newest, motion_options()),
                            options_.separates_motions);
}

void Mapper::exclude(KeyframeId id, const std::vector<char>& features) {
  std::vector<char>& excluded = map_state_.excluded[id];
  excluded.resize(features.size(), 0);
  for (std::size_t f = 0; f < features.size(); ++f) {
    if (!features[f]) continue;
    excluded[f] = 1;
    const LandmarkId l = map_.keyframe(id)->landmark_of_feature[f];
    if (l != kNoLandmark) map_.remove_landmark(l);
  }
}

bool Mapper::is_excluded(KeyframeId id, int feature) const {
  const auto found = map_state_.excluded.find(id);
  return found != map_state_.excluded.end() && found->second[feature] != 0;
}

// Checks that the map is of the largest object. With separate_motions(), all pairs are watched already.
void Mapper::watch_map_object() {
  if (!options_.watches_motions || options_.separates_motions || map_.keyframes().size() < 2) return;
  const auto newest = std::prev(map_.keyframes().end());
  watch_pair(std::prev(newest)->first, newest->first, nullptr);
}

void Mapper::report_doubt(TrackingMap* view) const {
  view->turning_object = map_state_.watch.object();
  view->doubt = map_state_.watch.doubt();
}

}  // namespace mono_pose_tracker
