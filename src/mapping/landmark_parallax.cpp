#include "landmark_parallax.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace mono_pose_tracker {

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
