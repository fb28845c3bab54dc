#include "view_hypothesis.h"

#include <algorithm>
#include <limits>

#include "common/statistics.h"
#include "geometry/triangulation.h"
#include "mono_pose_tracker/robust/absolute_pose.h"
#include "optimization/map_adjustment.h"

namespace mono_pose_tracker {

namespace {

// Distance in baselines of the first two views beyond which the viewpoint has no effect: 0.1 px at a focal
// length of 1000 px.
constexpr double kFar = 1e4;

// A far point for rays that do not intersect in front of the cameras because of noise. It constrains the
// rotation and must not cost as much as a wrong match.
Eigen::Vector3d far_point(const std::vector<Rigid3>& cameras_from_map,
                          const std::vector<Eigen::Vector3d>& bearings) {
  return kFar * common_direction(cameras_from_map, bearings);
}

void triangulate_pair(const ViewSet& views, const std::vector<char>& inliers, ViewHypothesis* h) {
  const Rigid3 second_from_first = h->cameras_from_map[1] * h->cameras_from_map[0].inverse();
  for (std::size_t i = 0; i < views.tracks.size(); ++i) {
    const Track& track = views.tracks[i];
    const Eigen::Vector3d& bearing1 = views.images[0]->set.bearings[track.feature_of_view[0]];
    const Eigen::Vector3d& bearing2 = views.images[1]->set.bearings[track.feature_of_view[1]];
    const bool is_near =
        inliers[i] && triangulate_two_views(second_from_first, bearing1, bearing2, &h->points[i]);
    h->is_point[i] = is_near || (inliers[i] && views.has_horizon);
    if (h->is_point[i] && !is_near) h->points[i] = far_point(h->cameras_from_map, {bearing1, bearing2});
  }
}

void adjust(const ViewSet& views, int num_views, const TrackerOptions& options, ViewHypothesis* h) {
  BundleProblem problem;
  problem.points = h->points;
  for (int v = 0; v < num_views; ++v) problem.cameras.push_back({h->cameras_from_map[v], false});
  for (std::size_t i = 0; i < views.tracks.size(); ++i) {
    if (!h->is_point[i]) continue;
    for (int v = 0; v < num_views; ++v) {
      const int f = views.tracks[i].feature_of_view[v];
      if (f < 0) continue;
      problem.observations.push_back(make_observation(v, static_cast<int>(i), *views.images[v], f));
    }
  }
  adjust_bundle(options.bundle, &problem);
  h->points = problem.points;
  for (int v = 0; v < num_views; ++v) h->cameras_from_map[v] = problem.cameras[v].camera_from_map;
}

bool register_view(const ViewSet& views, int v, const TrackerOptions& options, ViewHypothesis* h) {
  std::vector<Eigen::Vector3d> bearings, points;
  for (std::size_t i = 0; i < views.tracks.size(); ++i) {
    const int f = views.tracks[i].feature_of_view[v];
    if (f < 0 || !h->is_point[i]) continue;
    bearings.push_back(views.images[v]->set.bearings[f]);
    points.push_back(h->points[i]);
  }
  const AbsolutePoseReport report = estimate_absolute_pose(
      bearings, points, AbsolutePoseOptions::in_growing_map(options.ransac(views.focal_px)));
  if (!report.success) return false;
  h->cameras_from_map[v] = report.camera_from_map;
  h->confirmed =
      std::min(h->confirmed, static_cast<double>(report.num_inliers) / static_cast<double>(points.size()));
  return true;
}

// Triangulates the best point of every track, so that hypotheses are compared on the same observations.
void score(const ViewSet& views, double threshold_px, ViewHypothesis* h) {
  const double cap = threshold_px * threshold_px;
  h->cost = 0;
  h->num_points = 0;
  for (std::size_t i = 0; i < views.tracks.size(); ++i) {
    std::vector<Rigid3> cameras;
    std::vector<Eigen::Vector3d> bearings;
    for (std::size_t v = 0; v < views.images.size(); ++v) {
      const int f = views.tracks[i].feature_of_view[v];
      if (f < 0) continue;
      cameras.push_back(h->cameras_from_map[v]);
      bearings.push_back(views.images[v]->set.bearings[f]);
    }
    Eigen::Vector3d x_in_map;
    const bool is_near = triangulate_multi_view(cameras, bearings, &x_in_map);
    if (!is_near && views.has_horizon) x_in_map = far_point(cameras, bearings);
    bool agreed = is_near;
    for (std::size_t v = 0; v < views.images.size(); ++v) {
      const int f = views.tracks[i].feature_of_view[v];
      if (f < 0) continue;
      const double e2 =
          is_near || views.has_horizon
              ? reprojection_error(*views.images[v], f, h->cameras_from_map[v] * x_in_map).squaredNorm()
              : cap;
      agreed = agreed && e2 < cap;
      h->cost += std::min(e2, cap);
    }
    h->is_point[i] = agreed;
    h->num_points += agreed;
    if (agreed) h->points[i] = x_in_map;
  }
}

}  // namespace

ViewHypothesis grow_hypothesis(const ViewSet& views, const Rigid3& second_from_first,
                               const std::vector<char>& inliers, const TrackerOptions& options) {
  ViewHypothesis h;
  const int num_views = static_cast<int>(views.images.size());
  h.cameras_from_map.assign(num_views, Rigid3());
  h.cameras_from_map[1] = second_from_first;
  h.points.assign(views.tracks.size(), Eigen::Vector3d::Zero());
  h.is_point.assign(views.tracks.size(), 0);
  h.confirmed = num_views > 2 ? 1 : 0;
  triangulate_pair(views, inliers, &h);
  adjust(views, 2, options, &h);
  for (int v = 2; v < num_views; ++v) {
    if (!register_view(views, v, options, &h)) {
      h.confirmed = 0;
      h.cost = std::numeric_limits<double>::infinity();
      return h;
    }
  }
  if (num_views > 2) adjust(views, num_views, options, &h);
  score(views, options.inlier_threshold_px, &h);
  return h;
}

double median_parallax(const ViewSet& views, const ViewHypothesis& h) {
  std::vector<double> angles;
  const Eigen::Vector3d center0 = h.cameras_from_map[0].inverse().translation;
  const Eigen::Vector3d center1 = h.cameras_from_map[1].inverse().translation;
  for (std::size_t i = 0; i < views.tracks.size(); ++i) {
    if (h.is_point[i]) angles.push_back(parallax_angle(h.points[i], center0, center1));
  }
  return median(std::move(angles));
}

}  // namespace mono_pose_tracker
