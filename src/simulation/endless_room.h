#pragma once

#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/io/trajectory.h"
#include "simulation/camera_path.h"

namespace mono_pose_tracker {

/// What EndlessRoom simulates.
struct EndlessRoomOptions {
  CameraParameters camera;       // without distortion, see default_camera
  double rate_hz = 30;           // frames a second
  double noise_grey_levels = 2;  // standard deviation, of 255
  int lap_frames = 360;          // positions of the camera: 12 s and 2.3 m at 30 Hz
  std::uint64_t seed = 1;        // of textures, path and noise
  int threads = 0;               // of rendering, 0: all; no result depends on it
};

/// A hand-held camera that moves round the room of make_room_scene without end, at a few milliseconds per
/// frame. The positions of one lap are rendered beforehand with a margin. A frame is one of these views,
/// rotated by a random hand motion about the camera's centre (exact for any scene), with new noise. The speed
/// along the lap varies, so that no two frames are equal. Const after construction: may be shared between
/// threads.
class EndlessRoom {
 public:
  struct Frame {
    StampedPose truth;  // map_from_camera
    cv::Mat image;      // CV_8UC1
  };

  /// `progress` is called after each rendered view. Throws std::invalid_argument naming what is wrong.
  explicit EndlessRoom(const EndlessRoomOptions& options, const std::function<void()>& progress = {});

  /// Any frame from 0 on; the same for one seed whatever was asked for before.
  Frame frame(std::int64_t index) const;

 private:
  struct Hand {
    explicit Hand(Random random);
    Wander speed;
    Wander3 turn, shake;
  };

  void add_noise(std::int64_t index, cv::Mat* image) const;

  EndlessRoomOptions options_;
  CameraParameters wide_camera_;  // with the margin
  Hand hand_;
  std::vector<StampedPose> lap_;
  std::vector<cv::Mat> views_;  // CV_8UC1, of wide_camera_
  cv::Mat noise_;               // one long row, CV_8SC1
};

/// A hand-held camera that walks along an endless corridor and looks obliquely at its right wall: nothing is
/// revisited, and a map grows without limit. Ray-cast, a few milliseconds per frame of 160x120. Const after
/// construction: may be shared between threads.
class EndlessCorridor {
 public:
  /// Of the options, lap_frames and threads mean nothing here. Throws std::invalid_argument naming what is
  /// wrong.
  explicit EndlessCorridor(const EndlessRoomOptions& options);

  /// Any frame from 0 on; the same for one seed whatever was asked for before. Metres.
  EndlessRoom::Frame frame(std::int64_t index) const;

 private:
  Rigid3 map_from_camera(double seconds) const;
  float grey(const Eigen::Vector3d& from, const Eigen::Vector3d& along) const;

  EndlessRoomOptions options_;
  Wander3 sway_, turn_;
};

}  // namespace mono_pose_tracker
