#pragma once

#include <vector>

#include "mono_pose_tracker/common/random.h"
#include "mono_pose_tracker/io/map_file.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {

inline MapOrigin synthetic_origin() {
  MapOrigin origin;
  origin.camera = synthetic_camera().parameters();
  origin.camera.distortion = {-0.1, 0.02, 0, 0, 0};
  origin.descriptor = "root_sift";
  return origin;
}

/// Three keyframes that see the same points, one more that was removed, and a landmark that is gone.
inline Map synthetic_map() {
  Random random(3);
  const SyntheticScene scene = box_scene(20, random);
  const CameraModel camera(synthetic_origin().camera);
  Map map;
  std::vector<std::vector<int>> point_of(4);
  for (int k = 0; k < 4; ++k) {
    const Rigid3 camera_from_map = camera_at({0.2 * k, 0.01 * k, 0}, 0.02 * k);
    const Frame frame = synthetic_frame(scene, camera, camera_from_map, 0.5, 3 * k, random, &point_of[k]);
    map.add_keyframe(frame.index, frame.stamp_ns, camera_from_map, frame.image);
  }
  for (int p = 0; p < 20; ++p) {
    const LandmarkId l = map.add_landmark(scene.x_in_map[p]);
    for (int k = 0; k < 4; ++k) {
      for (std::size_t f = 0; f < point_of[k].size(); ++f) {
        if (point_of[k][f] == p) map.add_observation(l, k, static_cast<int>(f));
      }
    }
  }
  map.remove_keyframe(1, 2);
  for (const LandmarkId l : map.landmark_ids()) {
    if (map.landmark(l)->observations.size() < 2) map.remove_landmark(l);
  }
  map.remove_landmark(map.landmark_ids().front());
  map.set_scale_source(ScaleSource::kMarker);
  return map;
}

}  // namespace mono_pose_tracker
