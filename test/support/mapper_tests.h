#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "mapping/mapper_input.h"
#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/tracking/tracker_options.h"
#include "tracking/frame_registrar.h"

namespace mono_pose_tracker {

/// The default options without time limits, as for recordings. With a limit, a bundle adjustment on a busy
/// machine ends early and the result changes.
inline TrackerOptions unhurried_options() {
  TrackerOptions options;
  options.mapping.bundle_seconds = 1e9;
  return options;
}

/// The frame registered against the newest keyframe of a map. All corrections of the map are applied.
inline KeyframeCandidate registered_candidate(const TrackerOptions& options, const CameraModel& camera,
                                              const TrackingMap& map, const Frame& frame) {
  const KeyframeView& newest = map.keyframes.rbegin()->second;
  const RegistrationReport report =
      FrameRegistrar(options, camera).register_frame(frame, map, newest.id, std::nullopt);
  EXPECT_TRUE(report.success) << frame.index << ": " << report.text;
  return {map.map_id,          frame,
          newest.id,           report.camera_from_map * newest.camera_from_map.inverse(),
          report.observations, map.corrections.size()};
}

/// Distance of each of `found` from its truth, in the truth's unit, after alignment by the best similarity.
inline std::vector<double> aligned_errors(const std::vector<Eigen::Vector3d>& found,
                                          const std::vector<Eigen::Vector3d>& truth) {
  Sim3 truth_from_found;
  EXPECT_TRUE(align_sim3(found, truth, &truth_from_found));
  std::vector<double> errors;
  for (std::size_t i = 0; i < found.size(); ++i)
    errors.push_back((truth_from_found * found[i] - truth[i]).norm());
  return errors;
}

/// Root mean square of the distances.
inline double aligned_rmse(const std::vector<Eigen::Vector3d>& found,
                           const std::vector<Eigen::Vector3d>& truth) {
  double sum = 0;
  for (const double error : aligned_errors(found, truth)) sum += error * error;
  return std::sqrt(sum / static_cast<double>(found.size()));
}

}  // namespace mono_pose_tracker
