#include "known_baseline.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

namespace {

// Number of landmarks after which the result is tested: mostly the first hundred suffice.
constexpr std::size_t kTestAfter = 100;

// Relative to the largest pivot of an information matrix. A smaller pivot is rounding noise.
constexpr double kRounding = 1e-13;

// Information of a keyframe's pose from the landmarks added so far, which are fixed: x' = exp(w) x + v, order
// v, w.
class PoseInformation {
 public:
  PoseInformation(const Map& map, const Keyframe& keyframe) : map_(map), keyframe_(keyframe) {}

  bool is_complete() const { return next_ == keyframe_.landmark_of_feature.size(); }

  void add(std::size_t landmarks) {
    for (; landmarks > 0 && !is_complete(); ++next_) {
      const Landmark* landmark = map_.landmark(keyframe_.landmark_of_feature[next_]);
      if (!landmark) continue;
      add(next_, keyframe_.camera_from_map * landmark->x_in_map);
      --landmarks;
    }
  }

  // Variance of the keyframe's position along a unit direction of the map; infinite where the pose is not yet
  // determined.
  double variance_along(const Eigen::Vector3d& direction_in_map) const {
    Eigen::Matrix<double, 6, 1> direction = Eigen::Matrix<double, 6, 1>::Zero();
    direction.head<3>() = keyframe_.camera_from_map.rotation * direction_in_map;
    const auto decomposed = information_.ldlt();
    const auto pivots = decomposed.vectorD();
    if (!(pivots.minCoeff() > kRounding * pivots.maxCoeff())) return std::numeric_limits<double>::infinity();
    return direction.dot(decomposed.solve(direction));
  }

 private:
  // The ray's change with the pose is (I - r r^T) / |x| (v - x cross w): across the ray, as the second is.
  void add(std::size_t feature, const Eigen::Vector3d& x) {
    const Eigen::Vector3d ray = x.normalized();
    const double px_per_rad = keyframe_.image->pixel_from_bearing[feature].norm() / std::sqrt(2.0);
    const double weight = px_per_rad / keyframe_.image->sigma_px[feature];
    const Eigen::Matrix3d across = weight * weight * (Eigen::Matrix3d::Identity() - ray * ray.transpose());
    const Eigen::Matrix3d turn = weight * weight / x.squaredNorm() * cross_matrix(x);
    information_.topLeftCorner<3, 3>() += across / x.squaredNorm();
    information_.topRightCorner<3, 3>() -= turn;
    information_.bottomLeftCorner<3, 3>() += turn;
    information_.bottomRightCorner<3, 3>() += across;
  }

  const Map& map_;
  const Keyframe& keyframe_;
  std::size_t next_ = 0;  // feature
  Eigen::Matrix<double, 6, 6> information_ = Eigen::Matrix<double, 6, 6>::Zero();
};

}  // namespace

bool is_baseline_known(const Map& map, const Keyframe& first, const Keyframe& second) {
  const Eigen::Vector3d way = second.center_in_map() - first.center_in_map();
  const double length = way.norm();
  if (length <= 0) return false;
  const double min_significance = KnownBaselineOptions().min_significance;
  PoseInformation of_first(map, first), of_second(map, second);
  // Each landmark reduces the variance: if some landmarks determine the baseline, all do.
  while (true) {
    of_first.add(kTestAfter);
    of_second.add(kTestAfter);
    const double variance = of_first.variance_along(way / length) + of_second.variance_along(way / length);
    if (std::isfinite(variance) && length * length >= min_significance * min_significance * variance)
      return true;
    if (of_first.is_complete() && of_second.is_complete()) return false;
  }
}

namespace {

// Calls use(cosine) for each two rays, until it is false.
template <typename Use>
void for_each_two_rays(const Map& map, const Landmark& landmark, const Use& use) {
  std::vector<Eigen::Vector3d> rays;
  for (const Observation& o : landmark.observations) {
    const Eigen::Vector3d ray = (map.keyframe(o.keyframe)->center_in_map() - landmark.x_in_map).normalized();
    for (const Eigen::Vector3d& other : rays) {
      if (!use(ray.dot(other))) return;
    }
    rays.push_back(ray);
  }
}

}  // namespace

bool has_parallax(const Map& map, const Landmark& landmark, double min_angle) {
  const double max_cosine = std::cos(min_angle);
  bool found = false;
  for_each_two_rays(map, landmark, [&](double cosine) {
    found = cosine <= max_cosine;
    return !found;
  });
  return found;
}

double widest_parallax(const Map& map, const Landmark& landmark) {
  double least_cosine = 1;
  for_each_two_rays(map, landmark, [&](double cosine) {
    least_cosine = std::min(least_cosine, cosine);
    return true;
  });
  return std::acos(std::max(least_cosine, -1.0));
}

}  // namespace mono_pose_tracker
