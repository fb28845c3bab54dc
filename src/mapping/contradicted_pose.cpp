#include "contradicted_pose.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <optional>
#include <unordered_set>
#include <utility>
#include <vector>

#include "keyframe_landmarks.h"
#include "mono_pose_tracker/mapping/contradiction.h"
#include "mono_pose_tracker/mapping/landmark_pose.h"
#include "mono_pose_tracker/robust/absolute_pose.h"

namespace mono_pose_tracker {

namespace {

// Keyframes before and after one whose landmarks say where it is: two of each, since the nearest may be as
// wrong as it is.
constexpr std::size_t kOfEachSide = 2;
// Matches that a pose explains beyond what the old one does: fewer agree by chance (as of an astray pose).
constexpr int kLeastExplained = 15;
// Of the observations that agreed with the old pose: most. Those that the map has since bent to it do not
// agree with the right one; of a second body's motion none would but what is far.
constexpr double kMustKeep = 0.5;
// Of those that are moved one may have hidden what contradicts the next.
constexpr int kMostPasses = 3;

using Keyframes = std::vector<const Keyframe*>;

std::vector<LandmarkCandidate> landmarks_beside(const Map& map, const Keyframes& in_time, std::size_t k) {
  std::vector<LandmarkCandidate> candidates;
  std::unordered_set<LandmarkId> known;
  const std::size_t begin = k - std::min(k, kOfEachSide);
  const std::size_t end = std::min(k + kOfEachSide + 1, in_time.size());
  for (std::size_t other = begin; other < end; ++other) {
    if (other == k) continue;
    const Keyframe& keyframe = *in_time[other];
    const Eigen::Vector3d center = keyframe.center_in_map();
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
      const LandmarkId l = keyframe.landmark_of_feature[f];
      if (l == kNoLandmark || !known.insert(l).second) continue;
      candidates.push_back(
          make_candidate(l, map.landmark(l)->x_in_map, *keyframe.image, static_cast<int>(f), center));
    }
  }
  return candidates;
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

// A pose, and what it explains: feature and landmark.
struct OtherPose {
  Rigid3 camera_from_map;
  std::vector<std::pair<int, LandmarkId>> seen;
  int gain = 0;
};

std::optional<OtherPose> find_other_pose(const MapperOptions& options, const Map& map,
                                         const Keyframes& in_time, std::size_t k) {
  const Keyframe& keyframe = *in_time[k];
  const ImageFeatures& image = *keyframe.image;
  const std::vector<LandmarkCandidate> candidates = landmarks_beside(map, in_time, k);
  const std::vector<LandmarkMatch> matches = match_by_descriptors(candidates, image, options.matching);
  const LandmarkSight sight = sight_of(image, candidates, matches);
  AbsolutePoseOptions pose_options;
  pose_options.ransac = options.ransac;
  for (const LandmarkMatch& m : matches) pose_options.quality.push_back(static_cast<float>(m.distance2));
  const AbsolutePoseReport pose = estimate_absolute_pose(sight.bearings, sight.points, pose_options);
  if (!pose.success) return std::nullopt;
  const double max_px = options.mapping.max_reprojection_px;
  const auto explained = [&](const Rigid3& camera_from_map) {
    return inliers_of(image, candidates, matches, camera_from_map, max_px);
  };
  OtherPose other;
  other.camera_from_map = pose.camera_from_map;
  for (const LandmarkMatch& m : explained(pose.camera_from_map)) {
    other.seen.emplace_back(m.feature, candidates[m.candidate].id);
  }
  other.gain =
      static_cast<int>(other.seen.size()) - static_cast<int>(explained(keyframe.camera_from_map).size());
  if (other.gain < kLeastExplained) return std::nullopt;
  const int held = observations_kept(map, keyframe, keyframe.camera_from_map, max_px);
  const int kept = observations_kept(map, keyframe, pose.camera_from_map, max_px);
  if (kept <= kMustKeep * held) return std::nullopt;
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
  for (const auto& [feature, landmark] : other.seen) map->add_observation(landmark, id, feature);
}

bool contradict(const Map& map, const Keyframe& before, const Keyframe& after, std::vector<Match> matches) {
  if (contradiction_between(map, before, after, matches).is_significant()) return true;
  for (Match& m : matches) std::swap(m.first, m.second);
  return contradiction_between(map, after, before, matches).is_significant();
}

// Of two that contradict each other the one whose new pose explains more beyond its old one.
std::optional<KeyframeId> correct_one_of(const MapperOptions& options, const Keyframes& in_time,
                                         std::size_t first, Map* map) {
  const auto of_the_frame = map->keyframes().begin();
  std::optional<OtherPose> best;
  KeyframeId id = -1;
  for (const std::size_t k : {first, first + 1}) {
    const Keyframe& keyframe = *in_time[k];
    const bool stays = keyframe.frame_index < 0 || keyframe.id == of_the_frame->first ||
                       keyframe.id == std::next(of_the_frame)->first;
    if (stays) continue;
    std::optional<OtherPose> other = find_other_pose(options, *map, in_time, k);
    if (!other || (best && other->gain <= best->gain)) continue;
    best = std::move(other);
    id = keyframe.id;
  }
  if (!best) return std::nullopt;
  move(options, id, *best, map);
  return id;
}

}  // namespace

std::set<KeyframeId> correct_contradicted_poses(const MapperOptions& options, const MatchesInTime& matches,
                                                Map* map) {
  const Keyframes in_time = keyframes_in_time(*map);
  std::set<KeyframeId> moved;
  for (int round = 0; round < kMostPasses; ++round) {
    bool is_settled = true;
    for (std::size_t i = 0; i + 1 < in_time.size() && !is_set(options.ransac.cancelled); ++i) {
      if (!contradict(*map, *in_time[i], *in_time[i + 1], matches[i])) continue;
      const std::optional<KeyframeId> id = correct_one_of(options, in_time, i, map);
      if (!id) continue;
      moved.insert(*id);
      is_settled = false;
    }
    if (is_settled) break;
  }
  return moved;
}

}  // namespace mono_pose_tracker
