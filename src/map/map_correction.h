#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

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

}  // namespace mono_pose_tracker
