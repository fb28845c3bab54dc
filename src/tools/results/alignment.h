#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <vector>

#include "../json.h"
#include "io/given_positions.h"
#include "mono_pose_tracker/io/map_file.h"
#include "mono_pose_tracker/io/trajectory.h"
#include "pipeline/recording.h"
#include "robust/position_alignment.h"

namespace mono_pose_tracker {

struct AlignmentOptions {
  PositionAlignmentOptions positions;
  /// Largest difference of stamps between a position and a frame (ns), as in evaluate_trajectory. Between two
  /// successive frames the camera's position is interpolated.
  std::int64_t max_difference_ns = 10'000'000;
  /// Orientations of TUM lines are used if their median angle (deg) to the camera's, after one common
  /// rotation, is at most this. Otherwise they may belong to another object, or be the identity.
  double max_orientation_deg = 10;
  /// A camera whose positions come with an up direction is taken to be upright on average; its pitch may be
  /// as large as this (deg).
  double max_pitch_deg = 45;
  /// Share of outliers above which the result gets a warning: half of what least median of squares tolerates.
  double max_outlier_share = 0.25;
  /// Coordinates beyond this (m) are too large for the 32-bit numbers of points.ply: steps of 1/128 m.
  double max_coordinate = 1e5;
};

struct AlignedResult {
  Json report;                                   // `alignment` of report.json
  std::map<std::uint32_t, Sim3> world_from_map;  // of the maps that were moved, by FinishedMap::id
};

/// Transforms each map of the result, its poses and those of `live` into the frame of the given positions, in
/// metres (ScaleSource::kKnownBaseline). A map whose positions do not determine the transform stays, and the
/// result gets a warning with the reason.
AlignedResult align_to_positions(const GivenPositions& given, const AlignmentOptions& options,
                                 RecordingResult* result, PosesByMap* live);

/// Transforms the maps of a file like the result's maps with the same frames.
void move_as_aligned(const RecordingResult& result, const AlignedResult& aligned, SavedMaps* saved);

/// Rotates the frame of the given positions, whose axes may point anywhere, to optical axes as an overview
/// draws them (x right, y down, z forward): by quarter turns, so that the cameras' down is y.
Eigen::Quaterniond view_from_map(const std::vector<RegisteredFrame>& trajectory);

}  // namespace mono_pose_tracker
