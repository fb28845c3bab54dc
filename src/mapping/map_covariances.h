#pragma once

#include <functional>
#include <vector>

#include "mapping/mapper_limits.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// Number of fixed keyframes for a window of this size: those that share most landmarks with it. They include
/// nearly all covisible keyframes and bound the cost of the adjustment in a large map.
inline int held_keyframes(int window) { return 3 * window; }

/// Covariances of an adjusted window: the uncertainty within it plus that of the fixed keyframe that
/// constrains each one most. Errors of fixed keyframes are common to all keyframes relative to them, and no
/// number of points averages them out.
void update_covariances(const MapperOptions& options, const MapperLimits& limits, const Map& map,
                        const std::vector<KeyframeId>& window, KeyframeCovariances* covariances);

/// Covariances of a loaded map, computed window after window in the order of its keyframes.
KeyframeCovariances find_covariances(const MapperOptions& options, const MapperLimits& limits,
                                     const Map& map);

/// Covariances are in the keyframes' own frames, so that a transformation of the map changes only their
/// lengths.
void scale_covariances(const std::function<double(KeyframeId)>& scale_of, KeyframeCovariances* covariances);

}  // namespace mono_pose_tracker
