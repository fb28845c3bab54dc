// The part of the Mapper that removes outliers and redundant keyframes.

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <vector>

#include "common/rotation.h"
#include "keyframe_landmarks.h"
#include "landmark_parallax.h"
#include "mapping/mapper.h"

namespace mono_pose_tracker {

namespace {

// Limit of a capped map: a keyframe each half second for twelve minutes, as long as the tracker keeps the
// poses of frames at 30 Hz. Every snapshot has them all.
constexpr std::size_t kMostRemovedKeyframes = 1500;

// The search for the least useful keyframes takes time in proportion to the map, so that a fiftieth of a full
// capped map is removed at once.
constexpr std::size_t kRoomMadeAtOnce = 50;

// A keyframe is redundant for a landmark that this number of other keyframes observe (Mur-Artal et al.,
// ORB-SLAM, 2015).
constexpr int kOthers = 3;
// Two views cannot be inconsistent along the epipolar line. A landmark that two keyframes and none of this
// number of later ones observe is more often a wrong match than not.
constexpr KeyframeId kKeyframesToConfirm = 3;
// Two keyframes define the map's frame; a third is needed for inconsistencies.
constexpr std::size_t kFewestKeyframes = 3;

// Share of the keyframe's landmarks for which it is redundant: at least kOthers others observe them on the
// same scale or a finer one. 1 when it observes none.
double redundant_share(const Map& map, const Keyframe& keyframe) {
  constexpr float kSameScale = 1.26f;  // a layer of SIFT's three in an octave
  int all = 0, redundant = 0;
  for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
    const Landmark* landmark = map.landmark(keyframe.landmark_of_feature[f]);
    if (!landmark) continue;
    ++all;
    const float coarsest = kSameScale * keyframe.image->set.features[f].scale;
    int others = 0;
    for (const Observation& o : landmark->observations) {
      others += o.keyframe != keyframe.id &&
                map.keyframe(o.keyframe)->image->set.features[o.feature].scale <= coarsest;
    }
    redundant += others >= kOthers;
  }
  return all == 0 ? 1 : static_cast<double>(redundant) / all;
}

// The earliest of equals.
KeyframeId most_redundant(const std::map<KeyframeId, double>& shares) {
  return std::max_element(shares.begin(), shares.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

}  // namespace

// Removes observations with large reprojection errors, then landmarks with a single observation or too small
// a parallax.
void Mapper::cull_observations(const std::vector<LandmarkId>& landmarks) {
  for (const LandmarkId l : landmarks) {
    const Landmark* landmark = map_.landmark(l);
    if (!landmark) continue;
    for (const Observation& o : std::vector<Observation>(landmark->observations)) {
      if (error_px(*map_.keyframe(o.keyframe), o.feature, landmark->x_in_map) >
          options_.mapping.max_reprojection_px) {
        map_.remove_observation(l, o.keyframe);
      }
    }
    // Half the parallax that creation needs: bundle adjustment may move a point a little farther away.
    if (landmark->observations.size() < 2 ||
        !has_parallax(map_, *landmark, 0.5 * options_.mapping.min_parallax_deg * kDegree)) {
      map_.remove_landmark(l);
    }
  }
}

void Mapper::cull_young_landmarks(KeyframeId newest) {
  for (const LandmarkId l : map_.landmarks_created_by(newest - kKeyframesToConfirm)) {
    if (map_.landmark(l)->observations.size() == 2) map_.remove_landmark(l);
  }
}

// Removes keyframes whose landmarks enough others observe.
void Mapper::cull_keyframes(KeyframeId newest) {
  for (const KeyframeId id : neighbors(newest, options_.mapping.window_keyframes)) {
    if (map_.keyframes().size() <= kFewestKeyframes || id == map_.keyframes().begin()->first) continue;
    const std::vector<LandmarkId> seen = landmarks_of(*map_.keyframe(id));
    const auto redundant = std::count_if(seen.begin(), seen.end(), [&](LandmarkId l) {
      return map_.landmark(l)->observations.size() > static_cast<std::size_t>(kOthers);
    });
    if (redundant < options_.mapping.redundant_overlap * seen.size()) continue;
    if (!neighbors(id, 1).empty()) remove_keyframe(id);
  }
}

// The pose of a removed keyframe is stored relative to the keyframe with most common landmarks, else to the
// one before it.
void Mapper::remove_keyframe(KeyframeId id) {
  const std::vector<LandmarkId> seen = landmarks_of(*map_.keyframe(id));
  const std::vector<KeyframeId> nearest = neighbors(id, 1);
  map_.remove_keyframe(id, nearest.empty() ? std::prev(map_.keyframes().find(id))->first : nearest[0]);
  map_state_.excluded.erase(id);
  map_state_.unmasked.erase(id);
  covariances_.erase(id);
  cull_observations(seen);
}

void Mapper::remove_keyframes(const std::set<KeyframeId>& ids) {
  constexpr int kOfTheFrame = 2;
  auto keyframe = map_.keyframes().begin();
  std::set<KeyframeId> spared;
  for (int i = 0; i < kOfTheFrame && keyframe != map_.keyframes().end(); ++i) {
    spared.insert((keyframe++)->first);
  }
  for (const KeyframeId id : ids) {
    if (map_.keyframe(id) && !spared.count(id)) remove_keyframe(id);
  }
  // The baseline of a misregistered view gives no unit.
  if (unit_.baseline && !map_.keyframe(unit_.baseline->second) && ids.count(unit_.baseline->second) > 0)
    unit_.baseline.reset();
  for (const KeyframeId id : ids) {
    if (!map_.keyframe(id)) unit_.markers.erase(id);
  }
  publish();
}

// Above the limit, removes the most redundant keyframes, but never the first two, which define the map's
// frame, nor those near the camera.
void Mapper::cap_keyframes(KeyframeId newest) {
  const auto most = static_cast<std::size_t>(options_.mapping.max_keyframes);
  if (most == 0) return;
  // Frames of the last minutes are stored relative to these.
  map_.forget_removed_keyframes(kMostRemovedKeyframes);
  if (map_.keyframes().size() <= most) return;
  std::set<KeyframeId> spared = {newest};
  // At most half of the cap: a map smaller than two windows must lose some of its window.
  const int window = std::min(options_.mapping.window_keyframes, static_cast<int>(most / 2));
  for (const KeyframeId id : neighbors(newest, window)) spared.insert(id);
  auto first = map_.keyframes().begin();
  for (int i = 0; i < 2; ++i) spared.insert((first++)->first);
  std::map<KeyframeId, double> shares;
  for (const auto& [id, keyframe] : map_.keyframes()) {
    if (!spared.count(id)) shares[id] = redundant_share(map_, keyframe);
  }
  const std::size_t kept = most - most / kRoomMadeAtOnce;
  while (map_.keyframes().size() > kept && !shares.empty()) {
    const KeyframeId least_useful = most_redundant(shares);
    const auto affected = map_.covisible(least_useful);
    remove_keyframe(least_useful);
    shares.erase(least_useful);
    for (const auto& entry : affected) {
      const auto share = shares.find(entry.first);
      if (share != shares.end()) share->second = redundant_share(map_, *map_.keyframe(entry.first));
    }
  }
}

}  // namespace mono_pose_tracker
