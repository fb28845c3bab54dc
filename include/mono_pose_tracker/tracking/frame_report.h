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

/// A feature of the image, for drawings.
struct SeenFeature {
  enum class Fate : std::uint8_t { kUnmatched, kOutlier, kInlier };
  Eigen::Vector2f x_px;
  Fate fate = Fate::kUnmatched;
  std::int64_t landmark = -1;  // landmark of an inlier
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

/// The result of one image.
struct FrameReport {
  std::int64_t stamp_ns = 0;
  State state = State::kBootstrapping;
  Reason reason = Reason::kOk;
  std::string reason_text;        // the reason with its numbers, one line
  std::uint32_t epoch = 0;        // increases whenever a map is begun, loaded or switched to
  std::uint32_t map_id = 0;       // the map in which the frame is registered; 0: none
  std::uint32_t corrections = 0;  // number of corrections of this map; each moves poses
  double length_scale = 1;        // of lengths near the camera, by the corrections since the last report
  std::vector<std::uint32_t> inactive_maps;  // ids of the inactive maps, which may still be merged with it

  std::optional<Rigid3> map_from_camera;  // empty while there is no pose
  /// Covariance of map_from_camera as ROS defines it: x y z (map units) and rotations about the map's fixed
  /// axes (rad).
  Matrix6d covariance = Matrix6d::Zero();
  /// The part of the covariance that is due to the map; near images share it.
  Matrix6d map_covariance = Matrix6d::Zero();
  bool is_keyframe = false;
  ScaleSource scale = ScaleSource::kMapUnits;  // source of the unit of all lengths
  CalibrationSource calibration = CalibrationSource::kGiven;
  std::string segmentation = "none";  // the method that found the mask: mask, motion, background, ...
  cv::Mat mask;                       // CV_8UC1, 255 = the object; empty: the whole image was used

  int features = 0;
  int matches = 0;
  int inliers = 0;
  double median_parallax_deg = 0;
  double reprojection_rms_px = 0;
  int keyframes = 0;
  int landmarks = 0;
  int worker_backlog = 0;  // unfinished jobs of the mapper: waiting and running ones
  int load_level = 0;      // 0: nothing is skipped for lack of time
  StageTimes stages;

  /// After a correction, or after a switch to another map: the present poses of all frames registered in it.
  /// Otherwise empty.
  std::vector<RegisteredFrame> corrected;
  /// Stamps of earlier frames whose reported poses are no longer valid.
  std::vector<std::int64_t> withdrawn_ns;

  std::vector<SeenFeature> seen;    // every feature of the image
  std::vector<SeenMotion> motions;  // while there is no map: motions of the newest compared image
};

struct KeyframePose {
  std::int64_t stamp_ns = 0;
  Rigid3 map_from_camera;
};

/// A consistent copy of the map, for publishing or writing.
struct MapSnapshot {
  std::uint32_t epoch = 0;
  std::uint64_t revision = 0;  // grows with every change of the map
  std::vector<ColoredPoint> points;
  std::vector<KeyframePose> keyframes;  // by stamp
};

}  // namespace mono_pose_tracker
