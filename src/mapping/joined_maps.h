#pragma once

#include <vector>

#include "mapping/map_joiner.h"

namespace mono_pose_tracker {

/// Two maps in the frame and scale of the older one.
struct JoinedMaps {
  Map map;
  MergedIds added;     // offsets of the newer map's ids
  double scale = 1;    // of the newer one
  bool holds = false;  // at least half of the shared landmarks remain after the adjustment, as for a loop
  int failed_adjustments = 0;
};

/// Merges the common landmarks of two maps, and the keyframes of images that are in both, and adjusts the
/// boundary. newer_in_older: of the newer map (`map` of align_maps) with the older. It does not hold where
/// the older has not enough ids.
JoinedMaps join_maps(const MapperOptions& options, const Map& older, const Map& newer,
                     const MapAlignment& newer_in_older);

}  // namespace mono_pose_tracker
