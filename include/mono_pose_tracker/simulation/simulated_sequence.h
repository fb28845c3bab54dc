#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/io/trajectory.h"
#include "mono_pose_tracker/simulation/renderer.h"
#include "mono_pose_tracker/simulation/scene.h"

namespace mono_pose_tracker {

/// kBlock: round a block of houses, 200 m, and 15 m of it again; kEight: round two blocks, 220 m, the street
/// between them three times; kCorridor: 60 m past doors that are all alike, and back.
enum class SceneKind { kHead, kRoom, kPlane, kBlock, kEight, kCorridor };
enum class BackgroundKind { kPlain, kTextured };

/// What to simulate. Poses are map_from_camera; the map of the head scene is the head's own frame.
struct SequenceOptions {
  SceneKind scene = SceneKind::kHead;
  BackgroundKind background = BackgroundKind::kPlain;  // behind the head; stands still in the image
  int frames = 0;           // 0: 120 (block, eight and corridor: one every 0.25 m), or all poses of the path
  int lead_in = 0;          // frames of the background alone that come before them (head scene)
  CameraParameters camera;  // see default_camera
  bool lights_move_with_camera = true;  // as when the object turns; the room's lights are its own
  double noise_grey_levels = 0;         // standard deviation, of 255, the same in the three colours
  double blur_px = 0;                   // standard deviation of a Gaussian
  double exposure_drift = 0;            // greatest relative change of brightness, either way
  std::uint64_t seed = 1;               // of textures, path and noise
  double rate_hz = 30;
  double first_stamp_s = 1;       // not 0, which ROS takes for no stamp
  int samples = 2;                // per pixel side
  int threads = 0;                // 0: as many as the machine has; no result depends on it
  bool occluder = false;          // a hand that passes before the object
  std::vector<StampedPose> path;  // a path of one's own; empty: the scene's

  /// Throws std::invalid_argument naming key, value and what was expected.
  void validate() const;
};

/// Without distortion, the principal point in the middle, a focal length that suits the scene's own path.
CameraParameters default_camera(SceneKind scene, int width, int height);

struct SimulatedFrame {
  std::int64_t stamp_ns = 0;
  Rigid3 map_from_camera;  // identity in the lead-in, where there is nothing to have a pose against
  cv::Mat image;           // CV_8UC3, blue green red
  cv::Mat mask;            // CV_8UC1, 255 where the pixel's centre is on the object and nothing is before it
};

/// A sequence whose frames are rendered when asked for, in any order, each the same for one seed whatever was
/// rendered before and however many threads render it. Const after construction: may be shared between
/// threads.
class SimulatedSequence {
 public:
  /// Throws std::invalid_argument as SequenceOptions::validate and CameraModel do.
  explicit SimulatedSequence(const SequenceOptions& options);

  /// Frames, with those of the lead-in.
  int size() const { return options_.lead_in + static_cast<int>(path_.size()); }
  /// Ground truth: map_from_camera of each frame after the lead-in.
  const std::vector<StampedPose>& path() const { return path_; }
  const CameraModel& camera() const { return camera_; }
  const Scene& scene() const { return *scene_; }

  SimulatedFrame render(int frame) const;

 private:
  void make_path();
  void draw_object(int index, cv::Mat* color, cv::Mat* mask) const;
  std::int64_t stamp(int frame) const;
  double share_done(int index) const;
  Lighting lighting(int index) const;

  SequenceOptions options_;
  CameraModel camera_;
  std::shared_ptr<const Scene> scene_;
  Renderer renderer_;
  cv::Mat background_;
  std::vector<StampedPose> path_;
};

}  // namespace mono_pose_tracker
