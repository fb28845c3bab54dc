#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "map/map_correction.h"
#include "map/place_finder.h"
#include "map/turning_object.h"
#include "mono_pose_tracker/common/stage_timer.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/map/map_views.h"

namespace mono_pose_tracker {

/// Immutable snapshot of the map after the mapper's last change, shared by pointer. Unchanged parts are
/// shared with the snapshot before. Tracking reads it without a lock while the mapper, the only writer, works
/// on.
struct TrackingMap {
  std::uint32_t epoch = 0;
  std::uint32_t map_id = 0;  // unique, independent of the epoch
  std::uint64_t revision = 0;
  KeyframeViews keyframes;
  LandmarkPositions landmarks;  // x_in_map
  /// Covariance of keyframe poses, as x' = exp(w) x + v in their own frames (order v, w). Missing: unknown.
  KeyframeCovariances covariances;
  std::map<KeyframeId, KeyframeLink> removed_keyframes;
  ScaleSource scale_source = ScaleSource::kMapUnits;
  std::shared_ptr<const PlaceFinder> places;  // null: none is kept
  // Evidence against the newest keyframes (mapping/motion_watch.h); empty: none.
  std::string doubt;
  std::shared_ptr<const TurningObject>
      turning_object;                        // that the map should be of but is not; null: none known
  MapCorrections corrections;                // the latest, of this map and others
  std::vector<std::uint32_t> inactive_maps;  // ids
  StageTimes stages;                         // of the last change

  /// Pose of a keyframe, also of one that was removed; false for one that never was.
  bool camera_from_map(KeyframeId id, Rigid3* camera_from_map) const {
    return resolve_keyframe(keyframes, removed_keyframes, id, camera_from_map);
  }
};

using TrackingMapPtr = std::shared_ptr<const TrackingMap>;

}  // namespace mono_pose_tracker
