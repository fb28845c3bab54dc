#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "mono_pose_tracker/common/stage_timer.h"
#include "mono_pose_tracker/features/feature_set.h"
#include "mono_pose_tracker/map/image_features.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/map/map_views.h"

namespace mono_pose_tracker {

/// Motion of a feature: it is on the object that turns before the camera, or it moves independently of it.
enum class FeatureMotion : std::uint8_t { kUnknown, kTurns, kMovesOtherwise };

/// The features of an image that are on an object turning before the camera; one entry per feature.
struct TurningObject {
  ImageFeaturesPtr image;
  std::vector<FeatureMotion> sides;
};

/// Number of candidates from place recognition. In 95 % of the cases a correct one is among them, if there is
/// one.
constexpr int kBestPlaces = 5;

/// Finds keyframes with a similar appearance. May be called from any thread while the map grows: the result
/// may be newer than a snapshot, or removed from the map since.
class PlaceFinder {
 public:
  virtual ~PlaceFinder() = default;
  /// At most `count` keyframes, the most similar first.
  virtual std::vector<KeyframeId> find(const FeatureSet& features, int count) const = 0;
};

/// What holders of a map's ids and lengths must do after a correction (loop closed, maps joined, rescaled).
/// Poses stored relative to a keyframe need nothing else: the keyframe has moved.
struct MapCorrection {
  std::uint64_t sequence = 0;             // grows with each, from 1, whatever the map
  std::uint32_t of_map = 0;               // whose ids and lengths change
  std::uint32_t into_map = 0;             // what it is a part of from now on; of_map where it was not joined
  MergedIds added;                        // to ids from before the correction
  double scale = 1;                       // of lengths from before, but for keyframes in scale_of
  std::map<KeyframeId, double> scale_of;  // by the id after the correction
  bool other_geometry = false;            // turns and directions, too, are not what they were

  double length_scale(KeyframeId reference) const {
    const auto own = scale_of.find(reference);
    return own == scale_of.end() ? scale : own->second;
  }
};

using MapCorrections = std::vector<std::shared_ptr<const MapCorrection>>;  // of all maps, oldest first

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
  // Evidence against the newest keyframes (mapping/map_motions.h); empty: none.
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
