#include "mapping/projection_matcher.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "common/rotation.h"
#include "mono_pose_tracker/features/feature_set.h"
#include "mono_pose_tracker/features/matching.h"

namespace mono_pose_tracker {

LandmarkCandidate make_candidate(LandmarkId id, const Eigen::Vector3d& x_in_map, const ImageFeatures& image,
                                 int feature, const Eigen::Vector3d& center_in_map) {
  LandmarkCandidate c;
  c.id = id;
  c.x_in_map = x_in_map;
  c.descriptor = image.set.descriptor(feature);
  const Eigen::Vector3d ray = center_in_map - x_in_map;
  const double distance = ray.norm();
  c.seen_from = ray / distance;
  c.scale_times_distance = image.set.features[feature].scale * distance;
  c.focal_px = image.camera.focal();
  return c;
}

cv::Mat descriptors_of(const std::vector<LandmarkCandidate>& candidates) {
  return stacked_descriptors(candidates, [](const LandmarkCandidate& c) { return c.descriptor; });
}

namespace {

// Projects a candidate: pixel and scale. False when it is out of view, or viewed from a side from which SIFT
// would not match it.
class Visibility {
 public:
  Visibility(const CameraModel& camera, const Rigid3& camera_from_map, double max_view_angle_deg)
      : camera_(camera),
        camera_from_map_(camera_from_map),
        center_(camera_from_map.inverse().translation),
        focal_px_(camera.focal()),
        min_cosine_(std::cos(max_view_angle_deg * kDegree)) {}

  bool of(const LandmarkCandidate& c, Eigen::Vector2d* pixel, double* scale) const {
    if (!camera_.project(camera_from_map_ * c.x_in_map, pixel) || !camera_.in_image(*pixel)) return false;
    const Eigen::Vector3d ray = center_ - c.x_in_map;
    const double distance = ray.norm();
    *scale = c.scale_times_distance / distance * (focal_px_ / c.focal_px);
    return ray.dot(c.seen_from) >= min_cosine_ * distance;
  }

  // Angle between the present and the stored viewing direction, rad.
  double viewing_angle(const LandmarkCandidate& c) const {
    const Eigen::Vector3d ray = center_ - c.x_in_map;
    return std::atan2(ray.cross(c.seen_from).norm(), ray.dot(c.seen_from));
  }

 private:
  const CameraModel& camera_;
  const Rigid3& camera_from_map_;
  const Eigen::Vector3d center_;
  const double focal_px_;
  const double min_cosine_;
};

// Relative probability that SIFT matches a landmark after the viewing direction has changed by the angle
// (rad).
double known_again(double angle, double sigma) { return std::exp(-0.5 * angle * angle / (sigma * sigma)); }

}  // namespace

std::vector<LandmarkMatch> match_by_projection(const std::vector<LandmarkCandidate>& candidates,
                                               const ImageFeatures& image, const Rigid3& camera_from_map,
                                               const ProjectionMatchOptions& options) {
  const Visibility visibility(image.camera, camera_from_map, options.max_view_angle_deg);
  const double min_ratio2 = options.min_ratio * options.min_ratio;
  std::vector<LandmarkMatch> claim(image.size());  // of each feature
  for (std::size_t i = 0; i < candidates.size() && !is_set(options.cancelled); ++i) {
    const LandmarkCandidate& c = candidates[i];
    Eigen::Vector2d pixel;
    double scale;
    if (!visibility.of(c, &pixel, &scale)) continue;
    NearestTwo nearest;
    image.grid.visit_near(pixel, options.radius_px, [&](int f) {
      const double found = image.set.features[f].scale;
      if (found > scale * options.max_scale_ratio || scale > found * options.max_scale_ratio) return;
      nearest.offer(f, descriptor_distance2(c.descriptor, image.set.descriptor(f)));
    });
    if (nearest.index < 0 || nearest.best > options.max_distance2) continue;
    if (nearest.second != std::numeric_limits<int>::max() && nearest.best * min_ratio2 > nearest.second)
      continue;
    LandmarkMatch& held = claim[nearest.index];
    if (held.candidate < 0 || nearest.best < held.distance2) {
      held = {static_cast<int>(i), nearest.index, nearest.best};
    }
  }
  std::vector<LandmarkMatch> matches;
  for (const LandmarkMatch& m : claim) {
    if (m.candidate >= 0) matches.push_back(m);
  }
  return matches;
}

ExpectedFinds expected_finds(const std::vector<LandmarkCandidate>& candidates, const CameraModel& camera,
                             const Rigid3& camera_from_map, const ProjectionMatchOptions& options) {
  const Visibility visibility(camera, camera_from_map, options.max_view_angle_deg);
  const double sigma = options.known_again_sigma_deg * kDegree;
  ExpectedFinds finds;
  for (const LandmarkCandidate& c : candidates) {
    Eigen::Vector2d pixel;
    double scale;
    if (!visibility.of(c, &pixel, &scale) || scale < options.min_scale_px || scale > options.max_scale_px)
      continue;
    ++finds.in_view;
    finds.expected += known_again(visibility.viewing_angle(c), sigma);
  }
  return finds;
}

namespace {

class UnobservedInView {
 public:
  UnobservedInView(const Map& map, const Keyframe& keyframe, double radius_px)
      : map_(map), keyframe_(keyframe), radius_px_(radius_px), center_(keyframe.center_in_map()) {}

  void offer(const Landmark& landmark) {
    if (!is_near_a_feature(landmark.x_in_map) || is_seen(landmark)) return;
    const Observation* nearest = nearest_in_direction(landmark);
    if (!nearest) return;
    candidates_.push_back(make_candidate(landmark.id, landmark.x_in_map,
                                         *map_.keyframe(nearest->keyframe)->image, nearest->feature,
                                         center_of(nearest->keyframe)));
  }

  std::vector<LandmarkCandidate> take() { return std::move(candidates_); }

 private:
  // Tested first: it rejects most landmarks cheaply.
  bool is_near_a_feature(const Eigen::Vector3d& x_in_map) const {
    const ImageFeatures& image = *keyframe_.image;
    Eigen::Vector2d pixel;
    return image.camera.project(keyframe_.camera_from_map * x_in_map, &pixel) &&
           image.camera.in_image(pixel) && image.grid.has_near(pixel, radius_px_);
  }

  bool is_seen(const Landmark& landmark) const {
    return std::any_of(landmark.observations.begin(), landmark.observations.end(),
                       [&](const Observation& o) { return o.keyframe == keyframe_.id; });
  }

  const Observation* nearest_in_direction(const Landmark& landmark) {
    const Eigen::Vector3d direction = (center_ - landmark.x_in_map).normalized();
    const Observation* nearest = nullptr;
    double best_cosine = -2;
    for (const Observation& o : landmark.observations) {
      const Eigen::Vector3d ray = center_of(o.keyframe) - landmark.x_in_map;
      const double cosine = ray.normalized().dot(direction);
      if (cosine > best_cosine) best_cosine = cosine, nearest = &o;
    }
    return nearest;
  }

  const Eigen::Vector3d& center_of(KeyframeId id) {
    const auto [entry, is_new] = centers_.try_emplace(id);
    if (is_new) entry->second = map_.keyframe(id)->center_in_map();
    return entry->second;
  }

  const Map& map_;
  const Keyframe& keyframe_;
  const double radius_px_;
  const Eigen::Vector3d center_;
  std::unordered_map<KeyframeId, Eigen::Vector3d> centers_;  // of other keyframes, computed on demand
  std::vector<LandmarkCandidate> candidates_;
};

}  // namespace

std::vector<LandmarkCandidate> unobserved_in_view(const Map& map, const Keyframe& keyframe,
                                                  const std::optional<std::vector<LandmarkId>>& landmarks,
                                                  double radius_px) {
  UnobservedInView unseen(map, keyframe, radius_px);
  if (landmarks) {
    for (const LandmarkId l : *landmarks) unseen.offer(*map.landmark(l));
    return unseen.take();
  }
  for (const auto& entry : map.landmarks()) unseen.offer(entry.second);
  std::vector<LandmarkCandidate> candidates = unseen.take();
  std::sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  return candidates;
}

namespace {

constexpr PoseSupportOptions kSupport{};

constexpr int kColumns = 8, kRows = 6;

int cell_of(const ImageFeatures& image, int feature) {
  const Eigen::Vector2f& pixel = image.set.features[feature].pixel;
  const int column =
      std::clamp(static_cast<int>(kColumns * pixel.x() / image.camera.width()), 0, kColumns - 1);
  const int row = std::clamp(static_cast<int>(kRows * pixel.y() / image.camera.height()), 0, kRows - 1);
  return row * kColumns + column;
}

}  // namespace

PoseSupport pose_support(const ImageFeatures& image, const std::vector<int>& inliers,
                         const ExpectedFinds& in_map) {
  std::vector<char> any(kColumns * kRows), held(kColumns * kRows);
  for (int f = 0; f < image.size(); ++f) any[cell_of(image, f)] = 1;
  for (const int f : inliers) held[cell_of(image, f)] = 1;
  PoseSupport support;
  support.found = static_cast<int>(inliers.size());
  support.features = image.size();
  support.in_map = in_map;
  const auto cells = std::count(any.begin(), any.end(), 1);
  if (cells > 0) support.spread = static_cast<double>(std::count(held.begin(), held.end(), 1)) / cells;
  return support;
}

bool is_supported(const PoseSupport& support, int min_inliers) {
  const double most = std::max(support.features, kSupport.few_features), expected = support.in_map.expected;
  if (support.found < min_inliers || expected < min_inliers || support.spread < kSupport.min_spread)
    return false;
  const bool is_as_from_near =
      support.found >= kSupport.min_found_from_near * std::min<double>(support.in_map.in_view, most);
  return support.found >= kSupport.min_found * std::min(expected, most) &&
         (is_as_from_near || support.found <= kSupport.max_oblique_excess * expected);
}

bool is_confined_to_corner(const PoseSupport& support) { return support.spread < kSupport.corner; }

}  // namespace mono_pose_tracker
