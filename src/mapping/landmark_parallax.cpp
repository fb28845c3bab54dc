#include "landmark_parallax.h"

#include <cmath>
#include <vector>

namespace mono_pose_tracker {

bool has_parallax(const Map& map, const Landmark& landmark, double min_angle) {
  std::vector<Eigen::Vector3d> rays;
  const double max_cosine = std::cos(min_angle);
  for (const Observation& o : landmark.observations) {
    const Eigen::Vector3d ray = (map.keyframe(o.keyframe)->center_in_map() - landmark.x_in_map).normalized();
    for (const Eigen::Vector3d& other : rays) {
      if (ray.dot(other) <= max_cosine) return true;
    }
    rays.push_back(ray);
  }
  return false;
}

}  // namespace mono_pose_tracker
