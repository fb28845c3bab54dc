#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/common/stage_timer.h"
#include "mono_pose_tracker/common/status.h"
#include "mono_pose_tracker/io/ply.h"

namespace mono_pose_tracker {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// A feature of the image, as a drawing shows it.
struct SeenFeature {
  enum class Fate : std::uint8_t { kUnmatched, kOutlier, kInlier };
  Eigen::Vector2f x_px;
  Fate fate = Fate::kUnmatched;
  std::int64_t landmark = -1;  // of an inlier
};

/// A match between the bootstrap's reference image and a later one.
struct SeenMotion {
  Eigen::Vector2f from_px, to_px;
};

struct RegisteredFrame {
  std::int64_t index = 0;
  std::int64_t stamp_ns = 0;
  Rigid3 map_from_camera;
};

/// What became of one image.
struct FrameReport {
  std::int64_t stamp_ns = 0;
  State state = State::kBootstrapping;
  Reason reason = Reason::kOk;
  std::string reason_text;   // the reason with its numbers, one line
  std::uint32_t epoch = 0;   // counts maps: only grows, whenever another map is begun, loaded or gone back to
  std::uint32_t map_id = 0;  // names the map that the frame was posed in; 0: none
  std::uint32_t corrections = 0;             // of this map so far; each moves poses
  double length_scale = 1;                   // of lengths where the camera is, by those since the last report
  std::vector<std::uint32_t> inactive_maps;  // ids of those beside it, which it may yet be joined with

  std::optional<Rigid3> map_from_camera;  // empty while there is no pose
  /// Of map_from_camera as ROS defines it: x y z (map units) and rotations about the map's fixed axes (rad).
  Matrix6d covariance = Matrix6d::Zero();
  /// The part of it that is the map's, and so the same in images near by.
  Matrix6d map_covariance = Matrix6d::Zero();
  bool is_keyframe = false;
  ScaleSource scale = ScaleSource::kMapUnits;  // what the unit of all lengths rests on
  CalibrationSource calibration = CalibrationSource::kGiven;
  std::string segmentation = "none";  // the method that found the mask: mask, motion, background, ...
  cv::Mat mask;  // CV_8UC1, 255 = the object, as it was found; empty: all of the image was used

  int features = 0;
  int matches = 0;
  int inliers = 0;
  double median_parallax_deg = 0;
  double reprojection_rms_px = 0;
  int keyframes = 0;
  int landmarks = 0;
  int worker_backlog = 0;  // jobs of the mapper that are not done: those that wait and the one under way
  int load_level = 0;      // 0: nothing is left out for lack of time
  StageTimes stages;

  /// After a correction, or in a map that was gone back to: every frame posed in it, as it stands now. Else
  /// empty.
  std::vector<RegisteredFrame> corrected;
  /// Stamps of earlier frames whose poses, which were reported, no longer hold.
  std::vector<std::int64_t> withdrawn_ns;

  std::vector<SeenFeature> seen;    // every feature of the image
  std::vector<SeenMotion> motions;  // while there is no map: of the newest image that was compared
};

struct KeyframePose {
  std::int64_t stamp_ns = 0;
  Rigid3 map_from_camera;
};

/// A copy of the map to publish or write, consistent in itself.
struct MapSnapshot {
  std::uint32_t epoch = 0;
  std::uint64_t revision = 0;  // grows with every change of the map
  std::vector<ColoredPoint> points;
  std::vector<KeyframePose> keyframes;  // by stamp
};

}  // namespace mono_pose_tracker
