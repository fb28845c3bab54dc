#include "map_adjustment.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "optimization/bundle_solvers.h"
#include "reduced_system.h"

namespace mono_pose_tracker {

std::vector<KeyframeId> fixed_keyframes(const Map& map, const std::vector<LandmarkId>& landmarks,
                                        const std::vector<KeyframeId>& free, int max_fixed) {
  std::map<KeyframeId, int> count;
  for (const LandmarkId l : landmarks) {
    for (const Observation& o : map.landmark(l)->observations) ++count[o.keyframe];
  }
  for (const KeyframeId id : free) count.erase(id);
  std::vector<std::pair<int, KeyframeId>> order;
  for (const auto& [id, n] : count) order.emplace_back(-n, id);
  std::sort(order.begin(), order.end());
  std::vector<KeyframeId> fixed;
  for (const auto& entry : order) {
    if (static_cast<int>(fixed.size()) < max_fixed) fixed.push_back(entry.second);
  }
  std::sort(fixed.begin(), fixed.end());
  return fixed;
}

std::vector<LandmarkId> most_observed_landmarks(const Map& map, const std::vector<KeyframeId>& keyframes,
                                                int max_of_keyframe) {
  std::set<LandmarkId> chosen;
  for (const KeyframeId id : keyframes) {
    std::vector<std::pair<int, LandmarkId>> order;
    for (const LandmarkId l : map.keyframe(id)->landmark_of_feature) {
      if (l == kNoLandmark) continue;
      const auto views = static_cast<int>(map.landmark(l)->observations.size());
      if (views >= 2) order.emplace_back(-views, l);
    }
    const auto count = std::min<std::size_t>(order.size(), static_cast<std::size_t>(max_of_keyframe));
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end());
    for (std::size_t i = 0; i < count; ++i) chosen.insert(order[i].second);
  }
  return {chosen.begin(), chosen.end()};
}

namespace {

// A bundle problem and where its blocks came from.
struct MapProblem {
  BundleProblem bundle;
  std::vector<KeyframeId> keyframes;
  std::vector<LandmarkId> landmarks;
};

std::vector<LandmarkId> seen_by(const Map& map, const std::vector<KeyframeId>& keyframes) {
  std::set<LandmarkId> seen;
  for (const KeyframeId id : keyframes) {
    for (const LandmarkId l : map.keyframe(id)->landmark_of_feature) {
      if (l != kNoLandmark && map.landmark(l)->observations.size() >= 2) seen.insert(l);
    }
  }
  return {seen.begin(), seen.end()};
}

// The landmarks of a keyframe by decreasing value for its pose: the cells of the image take turns, and each
// gives the landmark with the most observations.
std::vector<LandmarkId> by_hold(const Map& map, const Keyframe& keyframe,
                                const LandmarkSelection& selection) {
  const int across = selection.cells_across, down = selection.cells_down;
  struct Entry {
    int rank = 0, cell = 0, observations = 0;
    LandmarkId id = kNoLandmark;
  };
  const std::vector<Feature>& features = keyframe.image->set.features;
  float width = 1, height = 1;
  for (const Feature& f : features)
    width = std::max(width, f.pixel.x()), height = std::max(height, f.pixel.y());
  std::vector<Entry> entries;
  for (std::size_t f = 0; f < features.size(); ++f) {
    const LandmarkId l = keyframe.landmark_of_feature[f];
    if (l == kNoLandmark) continue;
    const int column = std::min(across - 1, static_cast<int>(features[f].pixel.x() / width * across));
    const int row = std::min(down - 1, static_cast<int>(features[f].pixel.y() / height * down));
    entries.push_back({0, row * across + column, static_cast<int>(map.landmark(l)->observations.size()), l});
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return std::make_tuple(-a.observations, a.id) < std::make_tuple(-b.observations, b.id);
  });
  std::vector<int> count(static_cast<std::size_t>(across) * down, 0);
  for (Entry& e : entries) e.rank = count[e.cell]++;
  std::stable_sort(entries.begin(), entries.end(),
                   [](const Entry& a, const Entry& b) { return a.rank < b.rank; });
  std::vector<LandmarkId> ids;
  for (const Entry& e : entries) ids.push_back(e.id);
  return ids;
}

int count_observations(const Landmark& landmark, const std::set<KeyframeId>& keyframes) {
  return static_cast<int>(
      std::count_if(landmark.observations.begin(), landmark.observations.end(),
                    [&](const Observation& o) { return keyframes.count(o.keyframe) > 0; }));
}

// Splits the landmarks: those that constrain the free keyframes best, at most so many of each, and the
// others. A landmark with one observation in the problem constrains nothing and would drift along its ray.
std::pair<std::vector<LandmarkId>, std::vector<LandmarkId>> split_by_hold(
    const Map& map, const std::vector<LandmarkId>& landmarks, const std::vector<KeyframeId>& free,
    const std::vector<KeyframeId>& fixed, int max_of_keyframe, const LandmarkSelection& selection) {
  std::set<LandmarkId> chosen;
  for (const KeyframeId id : free) {
    const std::vector<LandmarkId> order = by_hold(map, *map.keyframe(id), selection);
    chosen.insert(order.begin(), order.begin() + std::min<std::size_t>(order.size(), max_of_keyframe));
  }
  std::set<KeyframeId> keyframes(free.begin(), free.end());
  keyframes.insert(fixed.begin(), fixed.end());
  std::pair<std::vector<LandmarkId>, std::vector<LandmarkId>> split;
  for (const LandmarkId l : landmarks) {
    const bool holds = chosen.count(l) && count_observations(*map.landmark(l), keyframes) >= 2;
    (holds ? split.first : split.second).push_back(l);
  }
  return split;
}

std::vector<KeyframeId> observing_keyframes(const Map& map, const std::vector<LandmarkId>& landmarks) {
  std::set<KeyframeId> keyframes;
  for (const LandmarkId l : landmarks) {
    for (const Observation& o : map.landmark(l)->observations) keyframes.insert(o.keyframe);
  }
  return {keyframes.begin(), keyframes.end()};
}

// Multiplications of an iteration's linear algebra: a dense decomposition of the cameras' reduced matrix, to
// which a landmark adds a block of 6x6 for each two of the free cameras that see it.
double camera_work(std::size_t free) { return 72 * std::pow(static_cast<double>(free), 3); }

double landmark_work(const Map& map, const std::vector<LandmarkId>& landmarks,
                     const std::vector<KeyframeId>& free) {
  double work = 0;
  for (const LandmarkId l : landmarks) {
    const std::vector<Observation>& seen = map.landmark(l)->observations;
    const auto views = static_cast<double>(std::count_if(seen.begin(), seen.end(), [&](const Observation& o) {
      return std::binary_search(free.begin(), free.end(), o.keyframe);
    }));
    work += 200 * views * (views + 3);
  }
  return work;
}

MapProblem build(const Map& map, const std::vector<KeyframeId>& free, const std::vector<KeyframeId>& fixed,
                 const std::vector<LandmarkId>& landmarks) {
  MapProblem problem;
  std::unordered_map<KeyframeId, int> camera_of;
  const auto add_camera = [&](KeyframeId id, bool constant) {
    camera_of[id] = static_cast<int>(problem.keyframes.size());
    problem.keyframes.push_back(id);
    problem.bundle.cameras.push_back({map.keyframe(id)->camera_from_map, constant});
  };
  for (const KeyframeId id : free) add_camera(id, false);
  for (const KeyframeId id : fixed) add_camera(id, true);
  problem.landmarks = landmarks;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const Landmark& l = *map.landmark(landmarks[i]);
    problem.bundle.points.push_back(l.x_in_map);
    for (const Observation& o : l.observations) {
      const auto camera = camera_of.find(o.keyframe);
      if (camera == camera_of.end()) continue;
      problem.bundle.observations.push_back(
          make_observation(camera->second, static_cast<int>(i), *map.keyframe(o.keyframe)->image, o.feature));
    }
  }
  return problem;
}

// Of the residuals.
std::vector<double> lengths_in_sigmas(const BundleProblem& problem) {
  std::vector<double> lengths;
  lengths.reserve(problem.observations.size());
  for (const BundleObservation& o : problem.observations) {
    const Eigen::Vector3d x = problem.cameras[o.camera].camera_from_map * problem.points[o.point];
    lengths.push_back((o.pixel_from_bearing * x / o.bearing.dot(x)).norm() / o.sigma_px);
  }
  return lengths;
}

BundleOptions with_spread(BundleOptions options, const BundleProblem& problem) {
  options.loss_width = loss_width_by_spread(options.loss_width, lengths_in_sigmas(problem));
  return options;
}

void store(const MapProblem& problem, Map* map) {
  for (std::size_t i = 0; i < problem.keyframes.size(); ++i) {
    const BundleCamera& camera = problem.bundle.cameras[i];
    if (!camera.constant) map->set_pose(problem.keyframes[i], camera.camera_from_map);
  }
  for (std::size_t i = 0; i < problem.landmarks.size(); ++i) {
    map->set_position(problem.landmarks[i], problem.bundle.points[i]);
  }
}

// The map is unchanged when the solve fails.
BundleReport solve(const BundleOptions& options, MapProblem* problem, Map* map) {
  const BundleReport report = adjust_bundle(with_spread(options, problem->bundle), &problem->bundle);
  if (report.usable) store(*problem, map);
  return report;
}

}  // namespace

BundleObservation make_observation(int camera, int point, const ImageFeatures& image, int feature) {
  return {camera, point, image.set.bearings[feature], image.pixel_from_bearing[feature],
          static_cast<double>(image.sigma_px[feature])};
}

BundleReport adjust_keyframes(const BundleOptions& options, const std::vector<KeyframeId>& free_keyframes,
                              int max_fixed, int max_landmarks, Map* map,
                              const LandmarkSelection& selection) {
  std::vector<KeyframeId> free = free_keyframes;
  std::sort(free.begin(), free.end());
  // The oldest keyframes stay fixed when the matrix of all would be too large.
  const double max_work = options.max_iteration_work > 0 ? options.max_iteration_work / 2
                                                         : std::numeric_limits<double>::infinity();
  while (camera_work(free.size()) > max_work) free.erase(free.begin());
  const std::vector<LandmarkId> landmarks = seen_by(*map, free);
  std::vector<KeyframeId> fixed = fixed_keyframes(*map, landmarks, free, max_fixed);
  // One fixed camera leaves the scale free: the window is then adjusted like a whole map.
  if (fixed.size() == 1) {
    free.insert(std::lower_bound(free.begin(), free.end(), fixed[0]), fixed[0]);
    fixed.clear();
  }
  auto [longest, others] = split_by_hold(*map, landmarks, free, fixed, max_landmarks, selection);
  while (max_landmarks > selection.least_landmarks && landmark_work(*map, longest, free) > max_work) {
    max_landmarks = std::min<int>(max_landmarks, static_cast<int>(longest.size())) / 2;
    std::tie(longest, others) = split_by_hold(*map, landmarks, free, fixed, max_landmarks, selection);
  }
  MapProblem problem = build(*map, free, fixed, longest);
  const BundleReport report = solve(options, &problem, map);
  if (others.empty() || !report.usable) return report;
  // Adjusts the other landmarks one by one, with the cameras fixed.
  MapProblem rest = build(*map, {}, observing_keyframes(*map, others), others);
  BundleOptions of_points = with_spread(options, rest.bundle);
  of_points.max_iterations = selection.point_iterations;
  adjust_points(of_points, &rest.bundle);
  store(rest, map);
  return report;
}

BundleOptions with_wide_loss(BundleOptions options) {
  options.loss_width *= 10;
  return options;
}

BundleReport adjust_map(const BundleOptions& options, Map* map) {
  std::vector<KeyframeId> all;
  for (const auto& entry : map->keyframes()) all.push_back(entry.first);
  MapProblem problem = build(*map, all, {}, seen_by(*map, all));
  return solve(options, &problem, map);
}

namespace {

using PoseCovariance = Eigen::Matrix<double, 6, 6>;
using Gauge = Eigen::Matrix<double, Eigen::Dynamic, 7>;

// Of a pose's (w, v) and of the point.
struct Linearized {
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 6> by_pose;
  Eigen::Matrix<double, 2, 3> by_point;
};

bool linearize(const Keyframe& keyframe, int feature, const Eigen::Vector3d& x_in_map, Linearized* result) {
  const BundleObservation o = make_observation(0, 0, *keyframe.image, feature);
  if (!is_usable(o)) return false;
  const Eigen::Vector3d x = keyframe.camera_from_map * x_in_map;
  const Reprojection reprojection(o.bearing, o.pixel_from_bearing / o.sigma_px, x);
  if (!reprojection.in_front) return false;
  result->residual = reprojection.residual;
  for (int row = 0; row < 2; ++row) {
    const Eigen::Vector3d d = reprojection.by_point.row(row).transpose();
    result->by_pose.block<1, 3>(row, 0) = x.cross(d).transpose();
    result->by_pose.block<1, 3>(row, 3) = d.transpose();
  }
  result->by_point = reprojection.by_point * keyframe.camera_from_map.rotation_matrix();
  return true;
}

// What turns, moves and sizes the cameras as a whole: their mean rotation, mean position and extent.
Gauge gauge_of(const Map& map, const std::vector<KeyframeId>& keyframes) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const KeyframeId id : keyframes) {
    middle += map.keyframe(id)->center_in_map() / static_cast<double>(keyframes.size());
  }
  Gauge gauge = Gauge::Zero(6 * static_cast<Eigen::Index>(keyframes.size()), 7);
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const Keyframe& keyframe = *map.keyframe(keyframes[i]);
    const Eigen::Matrix3d R = keyframe.camera_from_map.rotation_matrix();
    const auto row = 6 * static_cast<Eigen::Index>(i);
    gauge.block<3, 3>(row, 0) = R;
    gauge.block<3, 3>(row + 3, 3) = R;
    gauge.block<3, 1>(row + 3, 6) = R * (keyframe.center_in_map() - middle);
  }
  return gauge;
}

// The covariance for noise of variance 1. Each coordinate is scaled by its information: a point near a
// camera's lens has so much information on that camera that everything else would be lost to rounding.
std::optional<Eigen::MatrixXd> inverse_held_by(const Gauge& gauge, const Eigen::MatrixXd& information,
                                               double gauge_weight) {
  if (!(information.diagonal().minCoeff() > 0)) return std::nullopt;
  const Eigen::VectorXd unit = information.diagonal().cwiseSqrt().cwiseInverse();
  Gauge scaled = unit.asDiagonal() * gauge;
  scaled.colwise().normalize();
  Eigen::MatrixXd held = unit.asDiagonal() * information * unit.asDiagonal();
  held += gauge_weight * scaled * scaled.transpose();
  const std::optional<Eigen::MatrixXd> inverse = inverse_of_positive(held);
  if (!inverse) return std::nullopt;
  return Eigen::MatrixXd(unit.asDiagonal() * *inverse * unit.asDiagonal());
}

// Rotation first, as the reduced system has it; translation first, as covariances are told.
PoseCovariance translation_first(const PoseCovariance& c) {
  PoseCovariance result;
  result << c.bottomRightCorner<3, 3>(), c.bottomLeftCorner<3, 3>(), c.topRightCorner<3, 3>(),
      c.topLeftCorner<3, 3>();
  return result;
}

}  // namespace

std::map<KeyframeId, PoseCovariance> keyframe_covariances(const std::vector<KeyframeId>& keyframes,
                                                          int max_fixed, int max_landmarks, const Map& map,
                                                          const CovarianceOptions& options) {
  std::vector<KeyframeId> free = keyframes;
  std::sort(free.begin(), free.end());
  const std::vector<LandmarkId> landmarks = most_observed_landmarks(map, free, max_landmarks);
  std::vector<KeyframeId> held = fixed_keyframes(map, landmarks, free, max_fixed);
  if (held.size() < 2) {
    free.insert(free.end(), held.begin(), held.end());
    held.clear();
  }
  std::unordered_map<KeyframeId, int> pose_of;
  for (std::size_t i = 0; i < free.size(); ++i) pose_of[free[i]] = static_cast<int>(i);
  for (const KeyframeId id : held) pose_of[id] = -1;

  ReducedSystem system(static_cast<int>(free.size()), 0, options.loss_width);
  const Eigen::Matrix<double, 2, Eigen::Dynamic> nothing(2, 0);
  Linearized at;
  for (const LandmarkId l : landmarks) {
    const Landmark& landmark = *map.landmark(l);
    for (const Observation& o : landmark.observations) {
      const auto pose = pose_of.find(o.keyframe);
      if (pose == pose_of.end()) continue;
      if (linearize(*map.keyframe(o.keyframe), o.feature, landmark.x_in_map, &at)) {
        system.add(pose->second, at.by_pose, at.by_point, nothing, at.residual);
      }
    }
    system.eliminate_point();
  }
  if (system.variance() <= 0) return {};
  const std::optional<Eigen::MatrixXd> inverse =
      held.empty() ? inverse_held_by(gauge_of(map, free), system.information(), options.gauge_weight)
                   : inverse_of_positive(system.information());
  if (!inverse) return {};
  const Eigen::MatrixXd covariance = system.variance() * *inverse;
  std::map<KeyframeId, PoseCovariance> result;
  for (std::size_t i = 0; i < free.size(); ++i) {
    const auto at_row = 6 * static_cast<Eigen::Index>(i);
    result[free[i]] = translation_first(covariance.block<6, 6>(at_row, at_row));
  }
  return result;
}

}  // namespace mono_pose_tracker
