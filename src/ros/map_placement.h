#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <std_msgs/Header.h>

#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "robust/odometry_scale.h"
#include "ros/live_tracker.h"
#include "ros/output_frames.h"

namespace mono_pose_tracker {

/// Places and scales the map by external information: ~initialpose, and odometry (scale/odometry). For the
/// processing thread.
class MapPlacement {
 public:
  MapPlacement(bool scale_from_odometry, const OutputFrames& frames, LiveTracker& tracker)
      : scale_from_odometry_(scale_from_odometry), frames_(frames), tracker_(tracker) {}

  /// To be called after each image. report: in the map, not the world. Returns what was done, one line, or
  /// nothing.
  std::string follow(const std_msgs::Header& image_header, const FrameReport& report);

  /// Forgets the last pose, which is no longer valid: the map is another one, or images were skipped.
  void forget() { present_.reset(); }

  /// Moves the map so that the present pose (of the base, or of the camera without one) becomes the given
  /// one. Returns what was done; throws std::runtime_error with the reason if it cannot.
  std::string place(const geometry_msgs::PoseWithCovarianceStamped& pose);

 private:
  struct PresentPose {
    std_msgs::Header header;
    Rigid3 map_from_camera;
    ScaleSource scale = ScaleSource::kMapUnits;
  };
  /// Identifies the map and its unit; poses of different ones are unrelated. (Epoch, id, scale.)
  using MapState = std::tuple<std::uint32_t, std::uint32_t, ScaleSource>;

  std::string rescale();
  void follow_moves(const FrameReport& report);
  void follow_map(const FrameReport& report);

  const bool scale_from_odometry_;
  const OutputFrames& frames_;
  LiveTracker& tracker_;
  std::optional<PresentPose> present_;  // none while the camera is lost, or not looked for
  OdometryScale odometry_scale_;
  MapState state_;
  // The moves by ~initialpose that the newest report does not include yet.
  Rigid3 moved_from_map_;
  std::pair<std::uint32_t, std::uint32_t> moved_at_;  // map and corrections of the report before the moves
  bool is_rescaling_ = false;  // a correction is under way: its report has not come yet
};

}  // namespace mono_pose_tracker
