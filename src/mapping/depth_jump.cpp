#include "depth_jump.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/median.h"
#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

namespace {

constexpr float kBeside = 0.05f;  // of the image's longer side: what is farther off is another surface
constexpr float kAbout = 3;       // radii within which a point has others on all sides, or is past an edge
constexpr std::size_t kLeastPairs = 10;  // of fewer the median says little
// Nearer by as much: what comes in between is seldom half of all that is new.
constexpr double kMostNearer = 1.5;
// Through a fence or branches the far side may be all that is new.
constexpr double kMostFarther = 10;

struct DepthSight {
  Eigen::Vector2f pixel;
  double log_distance;
};

// The logarithm of how much farther it is than the nearest of those about it. Nothing where these are all on
// one side: there it may lie past the edge of what they are on.
std::optional<double> compare(const DepthSight& sight, const std::vector<DepthSight>& others,
                              float radius_px) {
  const float radius2 = radius_px * radius_px;
  float nearest = radius2;
  std::optional<double> ratio;
  std::array<bool, 4> quadrants{};
  for (const DepthSight& other : others) {
    const Eigen::Vector2f away = other.pixel - sight.pixel;
    const float distance2 = away.squaredNorm();
    if (distance2 >= kAbout * kAbout * radius2) continue;
    quadrants[2 * (away.x() > 0) + (away.y() > 0)] = true;
    if (distance2 >= nearest) continue;
    nearest = distance2;
    ratio = sight.log_distance - other.log_distance;
  }
  return std::count(quadrants.begin(), quadrants.end(), true) >= 3 ? ratio : std::nullopt;
}

}  // namespace

std::optional<double> depth_jump(const Map& map, KeyframeId newest, const std::vector<KeyframeId>& others) {
  std::vector<double> ratios;
  for (const KeyframeId id : others) {
    const Keyframe& keyframe = *map.keyframe(id);
    std::vector<DepthSight> known, made;
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
      const LandmarkId l = keyframe.landmark_of_feature[f];
      if (l == kNoLandmark) continue;
      const Landmark& landmark = *map.landmark(l);
      const double distance = (keyframe.camera_from_map * landmark.x_in_map).norm();
      (landmark.created_by == newest ? made : known)
          .push_back({keyframe.image->set.features[f].pixel, std::log(distance)});
    }
    const float radius_px = kBeside * static_cast<float>(longer_side(keyframe.image->camera));
    for (const DepthSight& sight : made) {
      if (const auto ratio = compare(sight, known, radius_px)) ratios.push_back(*ratio);
    }
  }
  if (ratios.size() < kLeastPairs) return std::nullopt;
  return std::exp(median(std::move(ratios)));
}

bool makes_depths_jump(const Map& map, KeyframeId newest, const std::vector<KeyframeId>& others) {
  const std::optional<double> ratio = depth_jump(map, newest, others);
  return ratio && (*ratio > kMostFarther || *ratio * kMostNearer < 1);
}

}  // namespace mono_pose_tracker
