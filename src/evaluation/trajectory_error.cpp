#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <utility>

#include "common/rotation.h"
#include "common/text.h"
#include "common/time_stamp.h"
#include "evaluation/trajectory_plot.h"
#include "geometry/nearest_rotation.h"
#include "io/plot.h"
#include "io/stamp.h"
#include "mono_pose_tracker/evaluation/trajectory_error.h"

namespace mono_pose_tracker {
namespace {

struct Match {
  std::size_t reference, estimate;
};

std::int64_t distance(std::int64_t a, std::int64_t b) { return a > b ? a - b : b - a; }

/// Index of the pose nearest in time; poses are sorted and not empty.
std::size_t nearest(const std::vector<StampedPose>& poses, std::int64_t stamp) {
  auto after =
      std::lower_bound(poses.begin(), poses.end(), stamp,
                       [](const StampedPose& pose, std::int64_t value) { return pose.stamp_ns < value; });
  const bool before_is_nearer =
      after == poses.end() || (after != poses.begin() && distance(std::prev(after)->stamp_ns, stamp) <
                                                             distance(after->stamp_ns, stamp));
  return (after - poses.begin()) - before_is_nearer;
}

std::vector<Match> match_by_stamp(const std::vector<StampedPose>& reference,
                                  const std::vector<StampedPose>& estimate, std::int64_t max_difference_ns) {
  if (reference.empty()) return {};
  std::map<std::size_t, std::size_t> estimate_of;  // by reference
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const std::size_t r = nearest(reference, estimate[i].stamp_ns);
    const auto difference = [&](std::size_t e) {
      return distance(reference[r].stamp_ns, estimate[e].stamp_ns);
    };
    if (difference(i) > max_difference_ns) continue;
    const auto [entry, is_new] = estimate_of.emplace(r, i);
    if (!is_new && difference(i) < difference(entry->second)) entry->second = i;
  }
  std::vector<Match> matches;
  matches.reserve(estimate_of.size());
  for (const auto& [r, e] : estimate_of) matches.push_back({r, e});
  return matches;
}

double median_of_middle_two(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

/// A pair of poses of one camera: map_from_camera in the reference's and in the estimate's map.
struct PosePair {
  std::int64_t stamp_ns;
  Rigid3 reference, estimate;
  double way = 0;  // along the reference's path, over all its frames, since the first pair
};

std::vector<PosePair> make_pairs(const std::vector<StampedPose>& reference,
                                 const std::vector<StampedPose>& estimate,
                                 const std::vector<Match>& matches) {
  std::vector<PosePair> pairs;
  std::size_t at = matches.front().reference;
  double way = 0;
  for (const Match& match : matches) {
    for (; at < match.reference; ++at) {
      way +=
          (reference[at + 1].map_from_camera.translation - reference[at].map_from_camera.translation).norm();
    }
    const StampedPose& pose = reference[match.reference];
    pairs.push_back({pose.stamp_ns, pose.map_from_camera, estimate[match.estimate].map_from_camera, way});
  }
  return pairs;
}

bool align(const std::vector<PosePair>& pairs, Alignment alignment, Sim3* reference_from_estimate) {
  std::vector<Eigen::Vector3d> in_reference, in_estimate;
  for (const PosePair& pair : pairs) {
    in_reference.push_back(pair.reference.translation);
    in_estimate.push_back(pair.estimate.translation);
  }
  return alignment == Alignment::kSim3 ? align_sim3(in_estimate, in_reference, reference_from_estimate)
                                       : align_se3(in_estimate, in_reference, reference_from_estimate);
}

void measure_positions(const std::vector<PosePair>& pairs, Alignment alignment, TrajectoryError* error) {
  if (!align(pairs, alignment, &error->reference_from_estimate)) {
    throw std::runtime_error(
        "the trajectories cannot be aligned: expected positions that do not all coincide");
  }
  std::vector<double> distances;
  double squares = 0;
  for (const PosePair& pair : pairs) {
    const Eigen::Vector3d aligned = error->reference_from_estimate * pair.estimate.translation;
    error->positions.push_back({pair.stamp_ns, pair.reference.translation, aligned});
    distances.push_back((aligned - pair.reference.translation).norm());
    squares += distances.back() * distances.back();
  }
  error->position_rmse = std::sqrt(squares / static_cast<double>(distances.size()));
  error->position_max = *std::max_element(distances.begin(), distances.end());
  error->position_median = median_of_middle_two(std::move(distances));
}

/// The rotation R with the least sum of |reference_i - R estimate_i|_F^2.
Eigen::Quaterniond best_rotation(const std::vector<PosePair>& pairs) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const PosePair& pair : pairs) {
    sum += (pair.reference.rotation * pair.estimate.rotation.conjugate()).toRotationMatrix();
  }
  return Eigen::Quaterniond(nearest_rotation(sum));
}

void measure_orientations(const std::vector<PosePair>& pairs, TrajectoryError* error) {
  const Eigen::Quaterniond reference_from_estimate = best_rotation(pairs);
  std::vector<double> angles;
  for (const PosePair& pair : pairs) {
    angles.push_back(
        rotation_angle_between(pair.reference.rotation, reference_from_estimate * pair.estimate.rotation) /
        kDegree);
    error->positions[angles.size() - 1].rotation_deg = angles.back();
  }
  error->rotation_max_deg = *std::max_element(angles.begin(), angles.end());
  error->rotation_median_deg = median_of_middle_two(std::move(angles));
}

void measure_steps(const std::vector<PosePair>& pairs, TrajectoryError* error) {
  std::vector<std::pair<Rigid3, Rigid3>> steps;  // camera i from camera i + 1: reference, estimate
  double length = 0;
  for (std::size_t i = 0; i + 1 < pairs.size(); ++i) {
    steps.emplace_back(pairs[i].reference.inverse() * pairs[i + 1].reference,
                       pairs[i].estimate.inverse() * pairs[i + 1].estimate);
    length += steps.back().first.translation.norm();
  }
  // The direction of a step shorter than a thousandth of the mean one is rounding of the reference.
  const double no_motion = 1e-3 * length / static_cast<double>(steps.size());
  std::vector<double> rotations, directions;
  for (const auto& [reference, estimate] : steps) {
    rotations.push_back(rotation_angle_between(reference.rotation, estimate.rotation) / kDegree);
    if (reference.translation.norm() <= no_motion) continue;
    directions.push_back(estimate.translation.isZero(0)
                             ? 180
                             : angle_between(reference.translation, estimate.translation) / kDegree);
  }
  error->relative_rotation_median_deg = median_of_middle_two(std::move(rotations));
  error->relative_direction_median_deg = median_of_middle_two(std::move(directions));
}

/// Error of the estimate's motion from one pair's camera to another's; scale: reference / estimate.
struct MotionError {
  double translation, rotation_deg;  // translation in the reference's units
};

MotionError motion_error(const PosePair& from, const PosePair& to, double scale) {
  const Rigid3 reference = from.reference.inverse() * to.reference;
  Rigid3 estimate = from.estimate.inverse() * to.estimate;
  estimate.translation *= scale;
  const Rigid3 difference = reference.inverse() * estimate;
  return {difference.translation.norm(),
          rotation_angle_between(reference.rotation, estimate.rotation) / kDegree};
}

/// The first pair at this distance along the path; pairs.size() when there is none.
std::size_t pair_at(const std::vector<PosePair>& pairs, double way) {
  // 1e-9: a whole path's length must not be missed by its rounding.
  const double reached = way - 1e-9 * pairs.back().way;
  return std::lower_bound(pairs.begin(), pairs.end(), reached,
                          [](const PosePair& pair, double value) { return pair.way < value; }) -
         pairs.begin();
}

void measure_relative_poses(const std::vector<PosePair>& pairs, const PoseDelta& delta,
                            TrajectoryError* error) {
  double translation = 0, rotation = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const std::size_t j = delta.unit == PoseDelta::Unit::kFrames
                              ? i + static_cast<std::size_t>(std::max(1.0, delta.size))
                              : std::max(i + 1, pair_at(pairs, pairs[i].way + delta.size));
    if (j >= pairs.size()) break;
    const MotionError e = motion_error(pairs[i], pairs[j], error->reference_from_estimate.scale);
    translation += e.translation * e.translation;
    rotation += e.rotation_deg * e.rotation_deg;
    ++error->rpe_pairs;
  }
  if (error->rpe_pairs == 0) return;
  error->rpe_translation_rmse = std::sqrt(translation / error->rpe_pairs);
  error->rpe_rotation_rmse_deg = std::sqrt(rotation / error->rpe_pairs);
}

void measure_drift(const std::vector<PosePair>& pairs, TrajectoryError* error) {
  double translation = 0, rotation = 0;
  int parts = 0;
  for (const double share : {0.1, 0.2, 0.3, 0.4, 0.5}) {
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const std::size_t j = std::max(i + 1, pair_at(pairs, pairs[i].way + share * pairs.back().way));
      if (j >= pairs.size()) break;
      const double length = pairs[j].way - pairs[i].way;
      if (length <= 0) continue;
      const MotionError e = motion_error(pairs[i], pairs[j], error->reference_from_estimate.scale);
      translation += 100 * e.translation / length;
      rotation += e.rotation_deg / length;
      ++parts;
    }
  }
  if (parts == 0) return;
  error->drift_translation_percent = translation / parts;
  error->drift_rotation_deg_per_length = rotation / parts;
}

std::optional<double> scale_drift_percent(const std::vector<PosePair>& pairs) {
  const double way = pairs.back().way;
  std::vector<PosePair> first, last;
  for (const PosePair& pair : pairs) {
    if (pair.way <= 0.25 * way) first.push_back(pair);
    if (pair.way >= 0.75 * way) last.push_back(pair);
  }
  Sim3 at_first, at_last;
  if (!align(first, Alignment::kSim3, &at_first) || !align(last, Alignment::kSim3, &at_last)) return {};
  return 100 * (at_last.scale / at_first.scale - 1);
}

/// View from the first camera; down is the average down direction of the cameras, as carried by a hand or a
/// car.
Rigid3 reference_from_view(const std::vector<PosePair>& pairs) {
  Eigen::Vector3d down = Eigen::Vector3d::Zero();
  for (const PosePair& pair : pairs) down += pair.reference.rotation * Eigen::Vector3d::UnitY();
  const Rigid3& first = pairs.front().reference;
  const Eigen::Vector3d right = down.cross(first.rotation * Eigen::Vector3d::UnitZ());
  // Cameras that roll over, or a first one that looks straight down, show no such axes.
  if (down.norm() < 0.1 * static_cast<double>(pairs.size()) || right.norm() < 0.1 * down.norm()) return first;
  Eigen::Matrix3d axes;
  axes.col(0) = right.normalized();
  axes.col(1) = down.normalized();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return {axes, first.translation};
}

}  // namespace

TrajectoryError evaluate_trajectory(const std::vector<StampedPose>& reference,
                                    const std::vector<StampedPose>& estimate,
                                    const EvaluationOptions& options) {
  const std::vector<Match> matches = match_by_stamp(reference, estimate, options.max_difference_ns);
  if (matches.size() < 3) {
    throw std::runtime_error(std::to_string(matches.size()) + " of " + std::to_string(estimate.size()) +
                             " estimated poses have a reference pose within " +
                             format_stamp(options.max_difference_ns) + " s: expected 3 at least");
  }
  const std::vector<PosePair> pairs = make_pairs(reference, estimate, matches);
  TrajectoryError error;
  error.frames_reference = static_cast<int>(reference.size());
  error.frames_matched = static_cast<int>(matches.size());
  error.reference_from_view = reference_from_view(pairs);
  measure_positions(pairs, options.alignment, &error);
  error.path_length = pairs.back().way;
  error.position_rmse_percent = 100 * error.position_rmse / error.path_length;
  measure_orientations(pairs, &error);
  measure_steps(pairs, &error);
  measure_relative_poses(pairs, options.delta, &error);
  measure_drift(pairs, &error);
  error.scale_drift_percent = scale_drift_percent(pairs);
  return error;
}

TrajectoryError evaluate_trajectory(const std::vector<StampedPose>& reference,
                                    const std::vector<StampedPose>& estimate,
                                    std::int64_t max_difference_ns) {
  EvaluationOptions options;
  options.max_difference_ns = max_difference_ns;
  return evaluate_trajectory(reference, estimate, options);
}

TrajectoryError united(const std::vector<TrajectoryError>& errors) {
  TrajectoryError all;
  double squares = 0;
  for (const TrajectoryError& error : errors) {
    all.positions.insert(all.positions.end(), error.positions.begin(), error.positions.end());
    all.position_max = std::max(all.position_max, error.position_max);
    all.rotation_max_deg = std::max(all.rotation_max_deg, error.rotation_max_deg);
    all.path_length += error.path_length;
    squares += error.position_rmse * error.position_rmse * static_cast<double>(error.positions.size());
  }
  if (errors.empty()) return all;
  std::stable_sort(
      all.positions.begin(), all.positions.end(),
      [](const MatchedPosition& a, const MatchedPosition& b) { return a.stamp_ns < b.stamp_ns; });
  all.position_rmse = std::sqrt(squares / static_cast<double>(all.positions.size()));
  all.position_rmse_percent = 100 * all.position_rmse / all.path_length;
  all.reference_from_view = errors.front().reference_from_view;
  return all;
}

namespace {

const cv::Scalar kReference(215, 110, 30), kEstimate(30, 140, 20), kError(40, 40, 215);

PlotRange range_of_axis(const std::vector<PlotSeries>& all, int axis) {
  std::vector<double> values;
  for (const PlotSeries& series : all) {
    for (const Eigen::Vector2d& point : series.points) values.push_back(point[axis]);
  }
  return with_margin(range_of(values), 0.05);
}

/// Both trajectories, seen along one of the view's axes.
PlotPanel view(const TrajectoryError& error, int x_axis, int y_axis, double y_sign) {
  const Rigid3 view_from_reference = error.reference_from_view.inverse();
  PlotSeries reference = {"reference", {}, kReference, 2, 4};
  PlotSeries estimate = {"estimate, aligned", {}, kEstimate, 2, 1};
  for (const MatchedPosition& p : error.positions) {
    const Eigen::Vector3d r = view_from_reference * p.reference, e = view_from_reference * p.estimate;
    reference.points.emplace_back(r[x_axis], y_sign * r[y_axis]);
    estimate.points.emplace_back(e[x_axis], y_sign * e[y_axis]);
  }
  PlotPanel panel;
  panel.equal_axes = true;
  panel.series = {reference, estimate};
  panel.x = range_of_axis(panel.series, 0);
  panel.y = range_of_axis(panel.series, 1);
  return panel;
}

/// A quantity of each matched frame over time.
template <typename Quantity>
PlotPanel over_time(const TrajectoryError& error, double most, const Quantity& quantity) {
  PlotSeries errors = {"", {}, kError, 2, 1};
  for (const MatchedPosition& p : error.positions) {
    const double seconds = seconds_between(error.positions.front().stamp_ns, p.stamp_ns);
    errors.points.emplace_back(seconds, quantity(p));
  }
  PlotPanel panel;
  panel.x_label = "s since the first matched frame";
  panel.series = {errors};
  panel.x = range_of_axis(panel.series, 0);
  panel.y = {0, std::max(1.05 * most, 1e-12)};
  return panel;
}

PlotPanel position_error_over_time(const TrajectoryError& error) {
  PlotPanel panel = over_time(error, error.position_max,
                              [](const MatchedPosition& p) { return (p.estimate - p.reference).norm(); });
  panel.title = formatted("position error (ATE): rmse %.4g, %.3g %% of the path", error.position_rmse,
                          error.position_rmse_percent);
  panel.y_label = "error (units of the reference)";
  return panel;
}

PlotPanel rotation_error_over_time(const TrajectoryError& error) {
  PlotPanel panel =
      over_time(error, error.rotation_max_deg, [](const MatchedPosition& p) { return p.rotation_deg; });
  panel.title = formatted("rotation error: %.3g degrees at most", error.rotation_max_deg);
  panel.y_label = "error (degrees)";
  return panel;
}

}  // namespace

cv::Mat draw_trajectory_plot(const TrajectoryError& error) {
  PlotPanel above = view(error, 0, 2, 1);
  above.title = "from above";
  above.x_label = "to the right of the first camera";
  above.y_label = "forward";
  PlotPanel side = view(error, 2, 1, -1);
  side.title = "from the side";
  side.x_label = "forward of the first camera";
  side.y_label = "up";
  const int size = 700, below = 360;
  cv::Mat picture(size + below, 2 * size, CV_8UC3, cv::Scalar::all(255));
  draw_panel(above, {0, 0, size, size}, &picture);
  draw_panel(side, {size, 0, size, size}, &picture);
  draw_panel(position_error_over_time(error), {0, size, size, below}, &picture);
  draw_panel(rotation_error_over_time(error), {size, size, size, below}, &picture);
  return picture;
}

void write_trajectory_plot(const std::string& path, const TrajectoryError& error) {
  write_picture(path, draw_trajectory_plot(error));
}

}  // namespace mono_pose_tracker
