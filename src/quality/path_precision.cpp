#include "quality/path_precision.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "mapping/keyframe_landmarks.h"
#include "optimization/map_adjustment.h"

namespace mono_pose_tracker {

namespace {

constexpr ScaleCutOptions kScaleCut{};

// One observation of a landmark: time, viewing ray, precision.
struct Ray {
  int place = 0;  // of its keyframe, in time
  Eigen::Vector3d direction;
  double sigma_rad = 0;
};

std::vector<Ray> rays_of(const Map& map, const Landmark& landmark, const std::map<KeyframeId, int>& place) {
  std::vector<Ray> rays;
  for (const Observation& o : landmark.observations) {
    const Keyframe& keyframe = *map.keyframe(o.keyframe);
    rays.push_back(
        {place.at(o.keyframe), (landmark.x_in_map - keyframe.center_in_map()).normalized(),
         kScaleCut.feature_sigma_px * keyframe.image->sigma_px[o.feature] / keyframe.image->camera.focal()});
  }
  std::sort(rays.begin(), rays.end(), [](const Ray& a, const Ray& b) { return a.place < b.place; });
  return rays;
}

// Squared relative depth error of the landmark triangulated from its first 2, 3, ... rays; by the number of
// rays.
std::vector<double> depth_variances(const std::vector<Ray>& rays) {
  std::vector<double> variances(rays.size() + 1, std::numeric_limits<double>::infinity());
  double widest = 0;
  for (std::size_t i = 1; i < rays.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k)
      widest = std::max(widest, rays[i].direction.cross(rays[k].direction).norm());
    if (widest > 0) variances[i + 1] = std::pow(rays[i].sigma_rad / widest, 2);
  }
  return variances;
}

}  // namespace

ScaleCut weakest_scale_cut(const Map& map) {
  const std::vector<const Keyframe*> in_time = keyframes_in_time(map);
  if (in_time.size() < 4) return {};
  const std::map<KeyframeId, int> place = places_in_time(in_time);
  // Changes from one cut to the next; cut k lies before keyframe k.
  std::vector<double> information(in_time.size() + 1, 0);
  std::vector<int> landmarks(in_time.size() + 1, 0);
  for (const LandmarkId id : map.landmark_ids()) {
    const std::vector<Ray> rays = rays_of(map, *map.landmark(id), place);
    const std::vector<double> before = depth_variances(rays),
                              after = depth_variances({rays.rbegin(), rays.rend()});
    for (std::size_t i = 2; i + 2 <= rays.size(); ++i) {
      const double variance = before[i] + after[rays.size() - i];
      if (!std::isfinite(variance)) continue;
      information[rays[i - 1].place + 1] += 1 / variance;
      information[rays[i].place + 1] -= 1 / variance;
      ++landmarks[rays[i - 1].place + 1];
      --landmarks[rays[i].place + 1];
    }
  }
  const std::vector<double> length = path_lengths(in_time);
  ScaleCut weakest;
  double known = 0;
  int count = 0;
  for (std::size_t k = 0; k < in_time.size(); ++k) {
    known += information[k];
    count += landmarks[k];
    if (count == 0) known = 0;  // what rounding has left of landmarks that end here
    // Two keyframes on each side are needed for separate baselines.
    if (k < 2 || k + 2 > in_time.size() || length.back() <= 0) continue;
    ScaleCut cut;
    cut.frame_index = in_time[k]->frame_index;
    cut.landmarks = count;
    cut.log_scale_sigma =
        known > 0 ? std::sqrt(kScaleCut.correlation / known) : std::numeric_limits<double>::infinity();
    cut.path_share = std::min(length[k - 1], length.back() - length[k]) / length.back();
    if (cut.path_sigma() > weakest.path_sigma()) weakest = cut;
  }
  return weakest;
}

namespace {

using Keyframes = std::vector<const Keyframe*>;

double extent_of(const Keyframes& keyframes) {
  const auto count = static_cast<double>(keyframes.size());
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Keyframe* keyframe : keyframes) middle += keyframe->center_in_map() / count;
  double squared = 0;
  for (const Keyframe* keyframe : keyframes) squared += (keyframe->center_in_map() - middle).squaredNorm();
  return std::sqrt(squared / count);
}

// Standard deviation of a position; infinite where it is not constrained.
double sigma_of(const Map& map, const Keyframes& keyframes) {
  std::vector<KeyframeId> ids;
  for (const Keyframe* keyframe : keyframes) ids.push_back(keyframe->id);
  const auto covariances = keyframe_covariances(ids, 0, std::numeric_limits<int>::max(), map);
  if (covariances.empty()) return std::numeric_limits<double>::infinity();
  double sum = 0;
  for (const auto& entry : covariances) sum += entry.second.topLeftCorner<3, 3>().trace();
  return std::sqrt(sum / static_cast<double>(covariances.size()));
}

}  // namespace

double PathPrecision::share() const {
  return length > 0 ? sigma / length : std::numeric_limits<double>::infinity();
}

PathPrecision path_precision(const Map& map, std::size_t most_keyframes) {
  const Keyframes in_time = keyframes_in_time(map);
  const std::size_t parts = (in_time.size() + most_keyframes - 1) / most_keyframes;
  PathPrecision path{0, path_lengths(in_time).back(), extent_of(in_time), weakest_scale_cut(map)};
  for (std::size_t part = 0; part < parts; ++part) {
    const auto at = [&](std::size_t i) {
      return in_time.begin() + static_cast<std::ptrdiff_t>(i * in_time.size() / parts);
    };
    path.sigma = std::max(path.sigma, sigma_of(map, Keyframes(at(part), at(part + 1))));
  }
  return path;
}

}  // namespace mono_pose_tracker
