#pragma once

#include <memory>
#include <mutex>
#include <utility>

#include "tracking/map_snapshot.h"

namespace mono_pose_tracker {

/// A copy of the map for drawing, made once and on first use: copying takes time proportional to the size of
/// the map, and often nobody subscribes. May be used from any thread.
class DrawnMap {
 public:
  /// map: null while there is none.
  explicit DrawnMap(TrackingMapPtr map) : map_(std::move(map)), newest_(newest_view_of(map_)) {}

  bool has_points() const { return map_ && !map_->landmarks.empty(); }
  const MapSnapshot& newest() const { return newest_; }
  const MapSnapshot& all() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!all_) all_ = snapshot_of(map_);
    return *all_;
  }
  bool is_copied() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return all_ != nullptr;
  }

 private:
  const TrackingMapPtr map_;
  const MapSnapshot newest_;
  mutable std::mutex mutex_;  // guards what follows
  mutable std::shared_ptr<const MapSnapshot> all_;
};

}  // namespace mono_pose_tracker
