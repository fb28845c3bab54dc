#pragma once

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "mapping/mapper_input.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {

/// Views of a scene with known correspondences between features and points.
class KnownScene {
 public:
  static constexpr double kNoise = 0.3;  // px

  explicit KnownScene(int points) : scene(box_scene(points, random)) {}

  /// The camera moves to the right and rotates to the left.
  static Rigid3 pose(int view) { return camera_at({0.15 * view, 0.02 * view, 0}, 0.035 * view); }

  Frame frame(int view) { return frame(view, pose(view)); }
  Frame frame(std::int64_t index, const Rigid3& camera_from_map) {
    return synthetic_frame(scene, camera, camera_from_map, kNoise, index, random, &point_of[index]);
  }

  int feature_of(std::int64_t frame_index, int point) const {
    const std::vector<int>& points = point_of.at(frame_index);
    const auto found = std::find(points.begin(), points.end(), point);
    return found == points.end() ? -1 : static_cast<int>(found - points.begin());
  }

  /// The first two views, with every `step`-th of their common points.
  InitialMap initial_map(int step) {
    InitialMap map;
    for (int v = 0; v < 2; ++v) map.views.push_back({frame(v), pose(v)});
    for (int p = 0; p < static_cast<int>(scene.x_in_map.size()); p += step) {
      const int first = feature_of(0, p), second = feature_of(1, p);
      if (first >= 0 && second >= 0) map.points.push_back({scene.x_in_map[p], {{0, first}, {1, second}}});
    }
    return map;
  }

  /// The point of all observations of a landmark; -1 when they differ.
  int point_of_landmark(const Map& map, const Landmark& landmark) const {
    int point = -1;
    for (const Observation& o : landmark.observations) {
      const int seen = point_of.at(map.keyframe(o.keyframe)->frame_index)[o.feature];
      if (point >= 0 && seen != point) return -1;
      point = seen;
    }
    return point;
  }

  Random random{17};
  CameraModel camera = synthetic_camera();
  SyntheticScene scene;
  std::map<std::int64_t, std::vector<int>> point_of;  // of each feature of a frame
};

}  // namespace mono_pose_tracker
