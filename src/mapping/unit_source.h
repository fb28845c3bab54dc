#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "mapping/initial_map.h"
#include "mapping/mapper_limits.h"
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
  std::optional<double> metres(ScaleSource source, const ScaleOptions& scale, const MapperLimits& limits,
                               const Map& map) const;
  /// Takes the source of a new map from its first views, which are the keyframes `ids`.
  ScaleSource begin(const InitialMap& initial, const std::vector<KeyframeId>& ids, const ScaleOptions& scale);
  /// After the removal of misregistered keyframes, which give no unit. map: without them.
  void forget(const std::set<KeyframeId>& wrong, const Map& map);
};

}  // namespace mono_pose_tracker
