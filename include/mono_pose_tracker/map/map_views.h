#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <set>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/map/image_features.h"
#include "mono_pose_tracker/map/shared_map.h"

namespace mono_pose_tracker {

using KeyframeId = int;
using LandmarkId = int;
constexpr LandmarkId kNoLandmark = -1;

/// Frames of earlier runs (of a map loaded from a file) have negative indices.
constexpr bool is_of_earlier_run(std::int64_t frame_index) { return frame_index < 0; }

class Map;

/// The data of a keyframe that registration (absolute pose) needs.
struct KeyframeView {
  KeyframeId id = -1;
  std::int64_t frame_index = 0;
  std::int64_t stamp_ns = 0;
  Rigid3 camera_from_map;
  ImageFeaturesPtr image;
  std::vector<LandmarkId> landmark_of_feature;
  std::vector<KeyframeId> covisible;  // most shared landmarks first
  std::vector<int> shared_landmarks;  // with each of these
};

using KeyframeViews = SharedMap<KeyframeView>;
using LandmarkPositions = SharedMap<Eigen::Vector3d, 128>;  // 3 kB: a window changes most of some dozens

using KeyframeCovariances = SharedMap<Eigen::Matrix<double, 6, 6>>;

/// Read-only views of a map, rebuilt only where the map has changed. Rebuilding the view of a keyframe takes
/// time proportional to its number of landmarks. Owned by the map, and copied with it.
class MapViews {
 public:
  void touch_keyframe(KeyframeId id) { stale_keyframes_.insert(id); }
  void touch_landmark(LandmarkId id) { stale_landmarks_.insert(id); }
  void touch_all();

  void refresh(const Map& map);
  const KeyframeViews& keyframes() const { return keyframes_; }
  const LandmarkPositions& landmarks() const { return landmarks_; }

 private:
  KeyframeViews keyframes_;
  LandmarkPositions landmarks_;
  std::set<KeyframeId> stale_keyframes_;
  std::set<LandmarkId> stale_landmarks_;
  bool all_stale_ = false;
};

}  // namespace mono_pose_tracker
