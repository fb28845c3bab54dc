#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "map/map_correction.h"
#include "map/tracking_map.h"

namespace mono_pose_tracker {

/// Where an image shows a landmark.
struct LandmarkPixel {
  LandmarkId landmark = kNoLandmark;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // as in the image
  float sigma_px = 1;                               // expected localisation error
};

/// Of one image: the landmarks that it was registered by. Some may be gone from the map by now.
using LandmarkPixels = std::shared_ptr<const std::vector<LandmarkPixel>>;

/// Of the images of a map, by frame index.
using RegisteredLandmarks = std::map<std::int64_t, LandmarkPixels>;

/// Where a posed frame stands: it rides on its reference keyframe.
struct FramePose {
  std::int64_t stamp_ns = 0;
  KeyframeId reference = -1;
  Rigid3 camera_from_reference;
  bool is_final = false;               // posed once more in the finished map
  bool is_stale = false;               // relative to a keyframe of a geometry that the map no longer has
  LandmarkPixels landmarks = nullptr;  // of a recording's frame; null: not kept
};

/// The frames posed against one map, by index. One thread.
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

  /// The map was corrected.
  void apply(const MapCorrection& correction);
  /// Those of a map that has become part of this one; its ids are this map's already.
  void take(const FramePoses& other);

  /// What the frames were registered by, where it was kept.
  RegisteredLandmarks landmarks() const;

  /// camera_from_map of a frame, now; false when it was never posed or its keyframe is of no known map.
  bool camera_from_map(const TrackingMap& map, std::int64_t index, Rigid3* camera_from_map) const;

 private:
  std::deque<Entry> poses_;  // by index; most come at its end. A map of them would take half as much again
};

}  // namespace mono_pose_tracker
