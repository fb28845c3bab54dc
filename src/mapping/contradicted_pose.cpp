#include "contradicted_pose.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "held_keyframe.h"
#include "keyframe_landmarks.h"
#include "landmark_candidates.h"
#include "likely_sight.h"
#include "mono_pose_tracker/mapping/contradiction.h"
#include "mono_pose_tracker/mapping/landmark_pose.h"

namespace mono_pose_tracker {

namespace {

// Keyframes before and after one whose landmarks say where it is: two of each, since the nearest may be as
// wrong as it is.
constexpr std::ptrdiff_t kOfEachSide = 2;
// Matches that a pose explains beyond what the old one does: fewer agree by chance (as of an astray pose).
constexpr int kLeastExplained = 15;
// Of the observations that agreed with the old pose: half. Those that the map has since bent to it do not
// agree with the right one; of a second body's motion that turns none would but what is far.
constexpr double kMustKeep = 0.5;
// Of those that are moved one may have hidden what contradicts the next.
constexpr int kMostPasses = 3;

using Keyframes = std::vector<const Keyframe*>;

// Of what those before and after it see, each matched by itself: two landmarks of one thing, as there are
// where a map contradicts itself, would be alike.
std::vector<LikelySight> sights_beside(const MapperOptions& options, const Map& map, const Keyframes& in_time,
                                       std::size_t k, const IsLeftOut& is_left_out) {
  const Keyframe& keyframe = *in_time[k];
  std::vector<LikelySight> sights;
  std::vector<char> is_known(keyframe.landmark_of_feature.size(), 0);
  for (std::ptrdiff_t apart = 1; apart <= kOfEachSide; ++apart) {
    for (const std::ptrdiff_t other :
         {static_cast<std::ptrdiff_t>(k) - apart, static_cast<std::ptrdiff_t>(k) + apart}) {
      if (other < 0 || other >= static_cast<std::ptrdiff_t>(in_time.size())) continue;
      const std::vector<LandmarkCandidate> candidates = candidates_of(map, {in_time[other]->id});
      for (const LandmarkMatch& m : match_by_descriptors(candidates, *keyframe.image, options.matching)) {
        if (is_known[m.feature] || is_left_out(keyframe.id, m.feature)) continue;
        is_known[m.feature] = 1;
        sights.push_back({m.feature, candidates[m.candidate].id, m.distance2});
      }
    }
  }
  return sights;
}

std::vector<LikelySight> explained(const MapperOptions& options, const Map& map, const Keyframe& keyframe,
                                   const std::vector<LikelySight>& sights, const Rigid3& camera_from_map) {
  std::vector<LikelySight> agreeing;
  for (const LikelySight& s : sights) {
    const Eigen::Vector3d x_in_camera = camera_from_map * map.landmark(s.landmark)->x_in_map;
    if (weighted_error(*keyframe.image, s.feature, x_in_camera) < options.mapping.max_reprojection_px)
      agreeing.push_back(s);
  }
  return agreeing;
}

int observations_kept(const Map& map, const Keyframe& keyframe, const Rigid3& camera_from_map,
                      double max_px) {
  int kept = 0;
  for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
    const LandmarkId l = keyframe.landmark_of_feature[f];
    if (l == kNoLandmark) continue;
    kept += weighted_error(*keyframe.image, static_cast<int>(f),
                           camera_from_map * map.landmark(l)->x_in_map) < max_px;
  }
  return kept;
}

// A pose, what it explains, and how much more that is than what the keyframe's own does.
struct OtherPose {
  Rigid3 camera_from_map;
  std::vector<LikelySight> seen;
  int gain = 0;
};

std::optional<OtherPose> find_other_pose(const MapperOptions& options, const Map& map,
                                         const Keyframes& in_time, std::size_t k,
                                         const IsLeftOut& is_left_out) {
  const Keyframe& keyframe = *in_time[k];
  const std::vector<LikelySight> sights = sights_beside(options, map, in_time, k, is_left_out);
  AbsolutePoseOptions pose_options;
  pose_options.ransac = options.ransac;
  pose_options.asks_outliers = true;
  for (const LikelySight& s : sights) pose_options.quality.push_back(static_cast<float>(s.distance2));
  const AbsolutePoseReport pose = pose_by(map, keyframe, sights, pose_options);
  if (!pose.success) return std::nullopt;
  OtherPose other;
  other.camera_from_map = pose.camera_from_map;
  other.seen = explained(options, map, keyframe, sights, pose.camera_from_map);
  other.gain = static_cast<int>(other.seen.size()) -
               static_cast<int>(explained(options, map, keyframe, sights, keyframe.camera_from_map).size());
  // It was fitted to them, the old one to others: as much more as no right map has against it.
  const double least = Contradiction::kMostOfARightMap * static_cast<double>(sights.size());
  if (other.gain < kLeastExplained || other.gain < least) return std::nullopt;
  const double max_px = options.mapping.max_reprojection_px;
  const int held = observations_kept(map, keyframe, keyframe.camera_from_map, max_px);
  const int kept = observations_kept(map, keyframe, pose.camera_from_map, max_px);
  if (kept < kMustKeep * held) return std::nullopt;
  return other;
}

// The keyframe sees what agrees with its new pose, and nothing else.
void move(const MapperOptions& options, KeyframeId id, const OtherPose& other, Map* map) {
  map->set_pose(id, other.camera_from_map);
  const Keyframe& keyframe = *map->keyframe(id);
  for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
    const LandmarkId l = keyframe.landmark_of_feature[f];
    if (l == kNoLandmark) continue;
    const double error = error_px(keyframe, static_cast<int>(f), map->landmark(l)->x_in_map);
    if (error < options.mapping.max_reprojection_px) continue;
    map->remove_observation(l, id);
    if (map->landmark(l)->observations.size() < 2) map->remove_landmark(l);
  }
  for (const LikelySight& s : other.seen) map->add_observation(s.landmark, id, s.feature);
}

// Of two that contradict each other the one whose new pose explains more beyond its old one: its place in
// time.
std::optional<std::size_t> correct_one_of(const MapperOptions& options, const Keyframes& in_time,
                                          std::size_t first, const IsLeftOut& is_left_out, Map* map) {
  std::optional<OtherPose> best;
  std::size_t place = 0;
  for (const std::size_t k : {first, first + 1}) {
    if (is_held(*map, *in_time[k])) continue;
    std::optional<OtherPose> other = find_other_pose(options, *map, in_time, k, is_left_out);
    if (!other || (best && other->gain <= best->gain)) continue;
    best = std::move(other);
    place = k;
  }
  if (!best) return std::nullopt;
  move(options, in_time[place]->id, *best, map);
  return place;
}

}  // namespace

std::set<KeyframeId> correct_contradicted_poses(const MapperOptions& options, const MatchesInTime& matches,
                                                const IsLeftOut& is_left_out, Map* map) {
  const Keyframes in_time = keyframes_in_time(*map);
  std::set<KeyframeId> moved;
  std::vector<char> is_due(in_time.size(), 1);
  for (int pass = 0; pass < kMostPasses; ++pass) {
    // Only what lies about those that were moved may be otherwise the next time.
    std::vector<char> is_due_next(in_time.size(), 0);
    for (std::size_t i = 0; i + 1 < in_time.size() && !is_set(options.ransac.cancelled); ++i) {
      if (!is_due[i]) continue;
      if (!contradiction_both_ways(*map, *in_time[i], *in_time[i + 1], matches[i]).is_significant()) continue;
      const std::optional<std::size_t> place = correct_one_of(options, in_time, i, is_left_out, map);
      if (!place) continue;
      moved.insert(in_time[*place]->id);
      const std::size_t reach = kOfEachSide + 1;
      const std::size_t begin = *place - std::min(*place, reach);
      const std::size_t end = std::min(*place + reach, in_time.size());
      std::fill(is_due_next.begin() + static_cast<std::ptrdiff_t>(begin),
                is_due_next.begin() + static_cast<std::ptrdiff_t>(end), 1);
    }
    is_due = std::move(is_due_next);
  }
  return moved;
}

}  // namespace mono_pose_tracker
