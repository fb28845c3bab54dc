#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "common/statistics.h"
#include "mono_pose_tracker/io/map_file.h"
#include "optimization/map_adjustment.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {

/// A different camera for each session.
inline CameraParameters synthetic_camera_of(int session) {
  CameraParameters camera = synthetic_camera().parameters();
  camera.distortion = {-0.1, 0.02, 0, 0, 0};
  camera.width += 32 * session;
  camera.fx += 10 * session;
  return camera;
}

/// A map with three keyframes that observe the same points, a removed keyframe and a removed landmark.
inline Map synthetic_map(int session = 0) {
  Random random(3);
  const SyntheticScene scene = box_scene(20, random);
  const CameraModel camera(synthetic_camera_of(session));
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

/// Two maps, each with its own session and camera: frames 0 to 19 and 20 to 39.
inline SavedMaps synthetic_saved_maps() {
  SavedMaps saved;
  saved.descriptor = "root_sift";
  for (int session = 0; session < 2; ++session) {
    saved.sessions.push_back({synthetic_camera_of(session), 20 * session, 20});
    saved.maps.push_back(synthetic_map(session));
    saved.maps.back().shift_frame_indices(20 * session);
  }
  saved.maps.back().set_scale_source(ScaleSource::kMapUnits);
  return saved;
}

inline CameraParameters with_focal(double factor) {
  CameraParameters p = synthetic_camera().parameters();
  p.fx *= factor;
  p.fy *= factor;
  return p;
}

// A map of a box of points. The images are rendered with the true cameras, one for each view, and the map is
// adjusted with the believed camera.
inline Map map_of(const std::vector<Rigid3>& poses, const std::vector<CameraModel>& truth,
                  const CameraModel& believed, int points = 300) {
  constexpr double kNoise = 0.3;  // px
  Random random(11);
  const SyntheticScene scene = box_scene(points, random);
  Map map;
  std::vector<std::vector<int>> point_of(poses.size());
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Frame frame = synthetic_frame(scene, truth[k], poses[k], kNoise, static_cast<std::int64_t>(k),
                                        random, &point_of[k]);
    map.add_keyframe(frame.index, frame.stamp_ns, poses[k],
                     restore_image_features({frame.image->set.features, frame.image->set.descriptors, {}},
                                            frame.image->color_rgb, believed));
  }
  for (std::size_t p = 0; p < scene.x_in_map.size(); ++p) {
    const LandmarkId l = map.add_landmark(scene.x_in_map[p]);
    for (std::size_t k = 0; k < poses.size(); ++k) {
      for (std::size_t f = 0; f < point_of[k].size(); ++f) {
        if (point_of[k][f] == static_cast<int>(p)) {
          map.add_observation(l, static_cast<KeyframeId>(k), static_cast<int>(f));
        }
      }
    }
    if (map.landmark(l)->observations.size() < 2) map.remove_landmark(l);
  }
  BundleOptions options;
  options.max_iterations = 100;
  adjust_map(options, &map);
  return map;
}

inline Map map_of(const std::vector<Rigid3>& poses, const CameraModel& truth, const CameraModel& believed,
                  int points = 300) {
  return map_of(poses, std::vector<CameraModel>(poses.size(), truth), believed, points);
}

// Poses that move to the right and rotate to the left, so that points are viewed from several sides and all
// over the image.
inline std::vector<Rigid3> round_about() {
  std::vector<Rigid3> poses;
  for (int k = 0; k < 12; ++k) {
    poses.push_back(camera_at({0.25 * k - 1.5, 0.1 * std::sin(k), 0.1 * std::cos(2 * k)}, 0.06 * k - 0.36));
  }
  return poses;
}

}  // namespace mono_pose_tracker
