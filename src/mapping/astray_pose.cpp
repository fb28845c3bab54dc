#include "astray_pose.h"

#include <algorithm>
#include <set>
#include <vector>

#include "mapping/second_motion.h"

namespace mono_pose_tracker {

namespace {

// Matches that the new motion explains beyond what the old one does: fewer agree by chance (second_motion).
constexpr int kLeastGain = 15;
// Of the landmarks that agreed with the old pose: some did so by chance, as wrong as it was.
constexpr double kKept = 0.8;
// Landmarks that each say how far the camera went, to be asked of all.
constexpr std::size_t kMostLengths = 50;

// A landmark that a feature of the keyframe sees, or would see if it were where its neighbour says.
struct Sighting {
  int feature;
  Eigen::Vector3d x_in_map;
};

std::vector<Sighting> sightings_held(const Map& map, const Keyframe& keyframe) {
  std::vector<Sighting> held;
  for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
    const LandmarkId l = keyframe.landmark_of_feature[f];
    if (l != kNoLandmark) held.push_back({static_cast<int>(f), map.landmark(l)->x_in_map});
  }
  return held;
}

// What the other keyframe has landmarks of, matched by descriptors.
std::vector<Sighting> sightings_by_match(const Map& map, const Keyframe& other, const PairMotions& pair) {
  std::vector<Sighting> matched;
  for (std::size_t i = 0; i < pair.matches.size(); ++i) {
    if (pair.obeyed[i] != ObeyedMotion::kOther && pair.obeyed[i] != ObeyedMotion::kBoth) continue;
    const LandmarkId l = other.landmark_of_feature[pair.matches[i].first];
    if (l != kNoLandmark) matched.push_back({pair.matches[i].second, map.landmark(l)->x_in_map});
  }
  return matched;
}

int gain(const PairMotions& pair) {
  const auto count = [&](ObeyedMotion motion) {
    return static_cast<int>(std::count(pair.obeyed.begin(), pair.obeyed.end(), motion));
  };
  return count(ObeyedMotion::kOther) - count(ObeyedMotion::kBody);
}

int count_agreeing(const ImageFeatures& image, const std::vector<Sighting>& sightings,
                   const Rigid3& camera_from_map, double max_px) {
  return static_cast<int>(std::count_if(sightings.begin(), sightings.end(), [&](const Sighting& s) {
    return weighted_error(image, s.feature, camera_from_map * s.x_in_map) < max_px;
  }));
}

double robust_cost(const ImageFeatures& image, const std::vector<Sighting>& sightings,
                   const Rigid3& camera_from_map, double max_px) {
  double cost = 0;
  for (const Sighting& s : sightings) {
    const double e = weighted_error(image, s.feature, camera_from_map * s.x_in_map);
    cost += e < max_px ? e * e : max_px * max_px;
  }
  return cost;
}

// How far along its direction the camera went, by all sightings; as far as before where they can't tell.
double best_length(const ImageFeatures& image, const std::vector<Sighting>& sightings,
                   const Rigid3& other_from_map, const Rigid3& newest_from_other, double before,
                   double max_px) {
  const auto cost_of = [&](double length) {
    const Rigid3 moved(newest_from_other.rotation, length * newest_from_other.translation);
    return robust_cost(image, sightings, moved * other_from_map, max_px);
  };
  double best = before, best_cost = cost_of(before) - max_px * max_px;
  const std::size_t step = std::max<std::size_t>(1, sightings.size() / kMostLengths);
  for (std::size_t i = 0; i < sightings.size(); i += step) {
    const Eigen::Vector3d& bearing = image.set.bearings[sightings[i].feature];
    const Eigen::Vector3d along = bearing.cross(newest_from_other.translation);
    const Eigen::Vector3d off =
        bearing.cross(newest_from_other.rotation * (other_from_map * sightings[i].x_in_map));
    const double length = -off.dot(along) / along.squaredNorm();
    if (!(length > 0)) continue;
    const double cost = cost_of(length);
    if (cost < best_cost) {
      best = length;
      best_cost = cost;
    }
  }
  return best;
}

// The sightings, and those of the other features.
std::vector<Sighting> joined(std::vector<Sighting> sightings, const std::vector<Sighting>& others) {
  std::set<int> features;
  for (const Sighting& s : sightings) features.insert(s.feature);
  for (const Sighting& s : others) {
    if (!features.count(s.feature)) sightings.push_back(s);
  }
  return sightings;
}

}  // namespace

bool correct_astray_pose(const MapperOptions& options, KeyframeId newest_id, KeyframeId other_id, Map* map) {
  const Keyframe &newest = *map->keyframe(newest_id), &other = *map->keyframe(other_id);
  const PairMotions pair =
      compare_motions(posed_image(other), posed_image(newest), options.matching, options.ransac);
  if (!pair.has_other || gain(pair) < kLeastGain) return false;
  const double max_px = options.mapping.max_reprojection_px;
  const std::vector<Sighting> held = sightings_held(*map, newest);
  const std::vector<Sighting> all = joined(sightings_by_match(*map, other, pair), held);
  const Rigid3& direction = pair.other_second_from_first;
  const double before = (newest.center_in_map() - other.center_in_map()).norm();
  const double length = best_length(*newest.image, all, other.camera_from_map, direction, before, max_px);
  const Rigid3 corrected = Rigid3(direction.rotation, length * direction.translation) * other.camera_from_map;
  const int agreed = count_agreeing(*newest.image, held, newest.camera_from_map, max_px);
  if (count_agreeing(*newest.image, held, corrected, max_px) < kKept * agreed) return false;
  map->set_pose(newest_id, corrected);
  return true;
}

}  // namespace mono_pose_tracker
