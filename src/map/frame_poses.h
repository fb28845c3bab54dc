#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "map/tracking_map.h"

namespace mono_pose_tracker {

/// Pixel of a landmark in an image.
struct LandmarkPixel {
  LandmarkId landmark = kNoLandmark;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // as in the image
  float sigma_px = 1;                               // expected localisation error
};

/// The landmarks by which an image was registered. Some may have been removed from the map since.
using LandmarkPixels = std::shared_ptr<const std::vector<LandmarkPixel>>;

/// For the images of a map, by frame index.
using RegisteredLandmarks = std::map<std::int64_t, LandmarkPixels>;

/// Pose of a registered frame, stored relative to its reference keyframe.
struct FramePose {
  std::int64_t stamp_ns = 0;
  KeyframeId reference = -1;
  Rigid3 camera_from_reference;
  LandmarkPixels landmarks = nullptr;  // of a recording's frame; null: not kept
  bool is_final = false;               // registered again in the finished map
  bool is_stale = false;               // relative to a keyframe of a discarded geometry
};

/// The frames registered in one map, by index. One thread.
class FramePoses {
 public:
  using Entry = std::pair<std::int64_t, FramePose>;

  void set(std::int64_t index, const FramePose& pose);
  const FramePose* find(std::int64_t index) const;
  void erase(std::int64_t index);
  bool empty() const { return poses_.empty(); }
  std::size_t size() const { return poses_.size(); }
  void clear() { poses_.clear(); }
  /// Forgets the oldest.
  void keep_newest(std::size_t most);
  const std::deque<Entry>& all() const { return poses_; }

  /// Applies a correction of the map.
  void apply(const MapCorrection& correction);
  /// Merges the frames of a map that was joined with this one; their ids are already those of this map.
  void take(const FramePoses& other);

  /// The landmarks by which the frames were registered, if kept.
  RegisteredLandmarks landmarks() const;

  /// The present camera_from_map of a frame; false when it was not registered or its keyframe is of no known
  /// map.
  bool camera_from_map(const TrackingMap& map, std::int64_t index, Rigid3* camera_from_map) const;

 private:
  std::deque<Entry> poses_;  // by index; most come at its end. A map of them would take half as much again
};

}  // namespace mono_pose_tracker
