#include "mapping/rigidity_check.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <vector>

#include "common/median.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "robust/motion_refinement.h"

namespace mono_pose_tracker {

namespace {

constexpr double kMedianChi2 = 5.35;  // 6 degrees of freedom

// Probability of at least this value; chi-squared, 6 degrees of freedom.
double chi2_tail(double value) {
  const double half = value / 2;
  return std::exp(-half) * (1 + half + half * half / 2);
}

// Observations of a keyframe; bearings and sigmas in rad.
struct KeyframeObservations {
  std::vector<Eigen::Vector3d> bearings, points;
  std::vector<double> sigmas;
  std::vector<double> px_per_rad;

  int size() const { return static_cast<int>(points.size()); }
};

using VectorRef = const Eigen::Vector3d&;

// Splits landmarks into two parts at the median of a value; middle: centroid of the bearings.
struct Split {
  const char* name;
  double (*value)(VectorRef bearing, VectorRef x_in_camera, VectorRef middle);
};

constexpr std::array<Split, 4> kSplits = {
    {{"left and right", [](VectorRef bearing, VectorRef, VectorRef) { return bearing.x(); }},
     {"upper and lower", [](VectorRef bearing, VectorRef, VectorRef) { return bearing.y(); }},
     {"near and far", [](VectorRef, VectorRef x_in_camera, VectorRef) { return x_in_camera.norm(); }},
     {"centre and border",
      [](VectorRef bearing, VectorRef, VectorRef middle) { return (bearing - middle).norm(); }}}};

struct Part {
  Rigid3 camera_from_map;
  Eigen::Matrix<double, 6, 6> covariance;
};

struct Comparison {
  bool is_known = false;
  double mahalanobis2 = 0;
  double px = 0;
};

KeyframeObservations observations_by(const Map& map, const Keyframe& keyframe) {
  KeyframeObservations visible;
  for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
    const Landmark* landmark = map.landmark(keyframe.landmark_of_feature[f]);
    // Two views cannot be inconsistent along the epipolar line.
    if (!landmark || landmark->observations.size() < 3) continue;
    const double px_per_rad = keyframe.image->pixel_from_bearing[f].norm() / std::sqrt(2.0);
    visible.bearings.push_back(keyframe.image->set.bearings[f]);
    visible.points.push_back(landmark->x_in_map);
    visible.px_per_rad.push_back(px_per_rad);
    visible.sigmas.push_back(keyframe.image->sigma_px[f] / px_per_rad);
  }
  return visible;
}

// Flags of the first part: values below the median.
std::vector<char> below_median(const std::vector<double>& values) {
  const double middle = median(values);
  std::vector<char> flags;
  for (const double v : values) flags.push_back(v < middle);
  return flags;
}

std::vector<char> first_part(const Split& split, const KeyframeObservations& visible,
                             const Rigid3& camera_from_map) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& b : visible.bearings) middle += b / visible.size();
  std::vector<double> values;
  for (int i = 0; i < visible.size(); ++i) {
    values.push_back(split.value(visible.bearings[i], camera_from_map * visible.points[i], middle));
  }
  return below_median(values);
}

bool pose_of(const KeyframeObservations& visible, const std::vector<char>& flags, bool first,
             const Rigid3& start, Part* part) {
  KeyframeObservations own;
  for (int i = 0; i < visible.size(); ++i) {
    if ((flags[i] != 0) != first) continue;
    own.bearings.push_back(visible.bearings[i]);
    own.points.push_back(visible.points[i]);
    own.sigmas.push_back(visible.sigmas[i]);
  }
  const MotionRefinementReport refined =
      refine_absolute_pose(own.bearings, own.points, own.sigmas, start, MotionRefinementOptions());
  if (!refined.converged) return false;
  part->camera_from_map = refined.camera_from_map;
  part->covariance = refined.covariance;
  return true;
}

// x' = exp(w) x + v of b after a; order v, w.
Eigen::Matrix<double, 6, 1> difference(const Rigid3& a, const Rigid3& b) {
  const Rigid3 b_from_a = b * a.inverse();
  const Eigen::AngleAxisd turn(b_from_a.rotation);
  Eigen::Matrix<double, 6, 1> d;
  d << b_from_a.translation, turn.angle() * turn.axis();
  return d;
}

double median_px(const KeyframeObservations& visible, const Rigid3& a, const Rigid3& b) {
  std::vector<double> px;
  for (int i = 0; i < visible.size(); ++i) {
    const Eigen::Vector3d from_a = (a * visible.points[i]).normalized(),
                          from_b = (b * visible.points[i]).normalized();
    px.push_back(visible.px_per_rad[i] * (from_a - from_b).norm());
  }
  return median(std::move(px));
}

Comparison compare(const KeyframeObservations& visible, const std::vector<char>& flags,
                   const Rigid3& camera_from_map, int min_landmarks) {
  Comparison comparison;
  const auto first = std::count(flags.begin(), flags.end(), 1);
  if (first < min_landmarks || visible.size() - first < min_landmarks) return comparison;
  Part a, b;
  if (!pose_of(visible, flags, true, camera_from_map, &a) ||
      !pose_of(visible, flags, false, camera_from_map, &b))
    return comparison;
  const Eigen::Matrix<double, 6, 1> d = difference(a.camera_from_map, b.camera_from_map);
  comparison.is_known = true;
  comparison.mahalanobis2 = d.dot((a.covariance + b.covariance).ldlt().solve(d));
  comparison.px = median_px(visible, a.camera_from_map, b.camera_from_map);
  return comparison;
}

// Comparisons of a keyframe's parts, and of two parts of alternating landmarks.
struct Witness {
  std::int64_t frame_index = 0;
  std::array<Comparison, kSplits.size()> splits;
  Comparison mixed;
};

Witness hear(const Map& map, const Keyframe& keyframe, int min_landmarks) {
  Witness witness;
  witness.frame_index = keyframe.frame_index;
  const KeyframeObservations visible = observations_by(map, keyframe);
  if (visible.size() < 2 * min_landmarks) return witness;
  for (std::size_t kind = 0; kind < kSplits.size(); ++kind) {
    witness.splits[kind] = compare(visible, first_part(kSplits[kind], visible, keyframe.camera_from_map),
                                   keyframe.camera_from_map, min_landmarks);
  }
  std::vector<char> every_other;
  for (int i = 0; i < visible.size(); ++i) every_other.push_back(i % 2);
  witness.mixed = compare(visible, every_other, keyframe.camera_from_map, min_landmarks);
  return witness;
}

// Factor by which the covariances are too small, in variance: at least 1.
double covariance_factor(const std::vector<Witness>& witnesses) {
  std::vector<double> mixed;
  for (const Witness& w : witnesses) {
    if (w.mixed.is_known) mixed.push_back(w.mixed.mahalanobis2);
  }
  return std::max(1.0, median(std::move(mixed)) / kMedianChi2);
}

// Medians of consecutive keyframes for one kind of parts; known where at least half of them have a
// comparison.
Comparison usual_of(std::size_t kind, std::vector<Witness>::const_iterator begin,
                    std::vector<Witness>::const_iterator end) {
  std::vector<double> distances, px;
  for (auto witness = begin; witness != end; ++witness) {
    const Comparison& c = witness->splits[kind];
    if (!c.is_known) continue;
    distances.push_back(c.mahalanobis2);
    px.push_back(c.px);
  }
  Comparison usual;
  usual.is_known = static_cast<std::ptrdiff_t>(2 * distances.size()) >= end - begin;
  if (!usual.is_known) return usual;
  usual.mahalanobis2 = median(std::move(distances));
  usual.px = median(std::move(px));
  return usual;
}

}  // namespace

RigidityReport check_rigidity(const Map& map, const RigidityOptions& options) {
  std::vector<Witness> witnesses;
  const auto size = static_cast<int>(map.keyframes().size());
  const int passed_over = options.newest > 0 ? std::max(0, size - options.newest) : 0;
  for (auto entry = std::next(map.keyframes().begin(), passed_over); entry != map.keyframes().end();
       ++entry) {
    const Witness witness = hear(map, entry->second, options.min_landmarks);
    if (witness.mixed.is_known) witnesses.push_back(witness);
  }
  RigidityReport report;
  report.keyframes = static_cast<int>(witnesses.size());
  if (report.keyframes < options.min_keyframes) return report;
  const double factor = covariance_factor(witnesses);
  const double least_px =
      options.min_disagreement_px * image_scale(map.keyframes().begin()->second.image->camera);
  const std::size_t stretch = std::min<std::size_t>(options.stretch, witnesses.size());
  const double tests = static_cast<double>(kSplits.size() * (witnesses.size() / stretch));
  for (std::size_t kind = 0; kind < kSplits.size(); ++kind) {
    for (auto begin = witnesses.begin(); witnesses.end() - begin >= static_cast<std::ptrdiff_t>(stretch);
         ++begin) {
      const Comparison usual = usual_of(kind, begin, begin + static_cast<std::ptrdiff_t>(stretch));
      const double distance = usual.mahalanobis2 / factor;
      if (!usual.is_known || usual.px < least_px || distance <= report.mahalanobis2) continue;
      report.parts = kSplits[kind].name;
      report.mahalanobis2 = distance;
      report.p_value = std::min(1.0, tests * chi2_tail(distance));
      report.disagreement_px = usual.px;
      report.frame_index = begin->frame_index;
    }
  }
  report.is_rigid = report.p_value >= options.significance;
  return report;
}

}  // namespace mono_pose_tracker
