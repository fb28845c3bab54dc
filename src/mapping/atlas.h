#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "map/tracking_map.h"
#include "mapping/loop_closer.h"
#include "mapping/map_joiner.h"
#include "mapping/map_motions.h"
#include "mapping/mapper_input.h"
#include "mapping/place_index.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// The source of a map's unit, to be evaluated again after adjustments.
struct UnitSource {
  // Bearings of the marker's corners in keyframes that observed it before the map had a scale.
  std::map<KeyframeId, std::vector<Eigen::Vector3d>> markers;
  std::optional<std::pair<KeyframeId, KeyframeId>> baseline;  // the two keyframes at a known distance

  /// Metres in a map unit, from `source`: the known baseline (a culled view has its stored pose), or the
  /// keyframes that observe the marker. Nothing while their parallax is too small, and for other sources.
  std::optional<double> metres(ScaleSource source, const ScaleOptions& scale, const Map& map) const;
  /// Takes the source of a new map from its first views, which are the keyframes `ids`.
  ScaleSource begin(const InitialMap& initial, const std::vector<KeyframeId>& ids, const ScaleOptions& scale);
  /// After the removal of misregistered keyframes, which give no unit. map: without them.
  void forget(const std::set<KeyframeId>& wrong, const Map& map);
};

/// A map and what belongs to it.
struct AtlasMap {
  std::uint32_t id = 0;
  Map map;
  std::shared_ptr<KeyframePlaces> places = std::make_shared<KeyframePlaces>();
  KeyframeCovariances covariances;  // of keyframes after their last adjustment (TrackingMap::covariances)
  UnitSource unit;
  MapMotions motions;  // begins anew when the map becomes the present one: its flags are lost
};

/// All maps: the present one, in which the camera is tracked, and the inactive ones; and the corrections of
/// all. Changes of the present map that others must follow are made here. Owned by the Mapper, used by its
/// thread.
///
///     atlas.keep_present();
///     atlas.begin(2, options).map.add_keyframe(...);
///     atlas.resume(1, true, options);
class Atlas {
 public:
  AtlasMap& present() { return present_; }
  const AtlasMap& present() const { return present_; }
  const Map& map() const { return present_.map; }
  std::vector<std::uint32_t> inactive_ids() const;
  const AtlasMap& inactive(std::uint32_t id) const { return *inactive_.at(id); }
  /// Copies of all maps including the present one, the oldest first.
  std::vector<Map> all_maps() const;

  /// Drops all maps.
  void clear() { present_.map = Map(), inactive_.clear(); }
  /// Begins an empty present map; the one before is dropped unless it was kept.
  AtlasMap& begin(std::uint32_t id, const MapperOptions& options);
  /// Makes the present map inactive, if there is one.
  void keep_present();
  /// Drops the smallest inactive maps until they hold at most this number of keyframes (0: no limit). The map
  /// that was just left stays, as the new one may fail.
  void cap_inactive(std::size_t most_keyframes);
  /// Makes an inactive map the present one, which is kept or dropped. False when there is none with this id.
  bool resume(std::uint32_t id, bool keeps_present, const MapperOptions& options);
  /// Replaces two maps, one of which is the present one, by the joined map. It has the older one's unit if
  /// that has one, else the newer one's.
  void join(std::uint32_t older_id, std::uint32_t newer_id, JoinedMaps joined, const MapperOptions& options);

  // Changes of the present map.
  /// Applies a similarity. scale_source: the new source of its unit; nothing: unchanged.
  void transform(const Sim3& new_from_map, std::optional<ScaleSource> scale_source = std::nullopt);
  /// Evaluates the source of the unit again after a global adjustment: at the beginning it was accurate to
  /// some per cent, and bundle adjustment does not preserve it. least_change: relative. Returns whether the
  /// map was rescaled.
  bool renew_unit(const ScaleOptions& scale, double least_change);
  /// Records the changes that were made to the map.
  void add_correction(const KeyframeChanges& changes);
  /// Records that the map has another geometry.
  void add_other_geometry();
  /// The pose of the keyframe is stored relative to the one with most common landmarks, else to the one
  /// before it.
  void remove_keyframe(KeyframeId id, const MapperOptions& options);
  /// Removes keyframes with wrong poses, and landmarks that only they observe.
  void remove_keyframes(const std::set<KeyframeId>& ids, const MapperOptions& options);

  const MapCorrections& corrections() const { return corrections_; }
  std::uint64_t last_correction() const { return last_correction_; }  // its sequence
  /// For endless runs. While no keyframes are inserted all corrections should be kept: they may not have been
  /// read yet.
  void forget_old_corrections(std::size_t most);
  /// Updates the ids and lengths of a candidate that was registered earlier. Returns false where it was
  /// registered in a geometry that the map no longer has, which makes its pose invalid.
  bool bring_up_to_date(KeyframeCandidate* candidate) const;

  /// All maps at one time, to return to.
  struct Checkpoint;
  Checkpoint checkpoint();
  void go_back(const Checkpoint& checkpoint);

 private:
  using InactiveMaps = std::map<std::uint32_t, std::shared_ptr<const AtlasMap>>;

  void add(MapCorrection correction);

  AtlasMap present_;
  InactiveMaps inactive_;
  MapCorrections corrections_;
  std::uint64_t last_correction_ = 0;
};

struct Atlas::Checkpoint {
  Map::Snapshot map;
  AtlasMap present;  // without its map
  InactiveMaps inactive;
  MapCorrections corrections;
  std::uint64_t last_correction = 0;
};

/// Covariances of an adjusted window: the uncertainty within it plus that of the fixed keyframe that
/// constrains each one most. Errors of fixed keyframes are common to all keyframes relative to them, and no
/// number of points averages them out.
void update_covariances(const MapperOptions& options, const Map& map, const std::vector<KeyframeId>& window,
                        KeyframeCovariances* covariances);

/// Covariances of a loaded map, computed window after window in the order of its keyframes.
KeyframeCovariances find_covariances(const MapperOptions& options, const Map& map);

/// Covariances are in the keyframes' own frames, so that a transformation of the map changes only their
/// lengths.
void scale_covariances(const std::function<double(KeyframeId)>& scale_of, KeyframeCovariances* covariances);

}  // namespace mono_pose_tracker
