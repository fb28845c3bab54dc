#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/io/trajectory.h"
#include "simulation/head_scene.h"
#include "simulation/renderer.h"
#include "simulation/scene.h"

namespace mono_pose_tracker {

/// kBlock: round a block of houses, 200 m, and 15 m of it again; kEight: round two blocks, 220 m, with the
/// street between them three times; kCorridor: 60 m past identical doors, and back; kTurntable: a bust, one
/// rotation on a turntable.
enum class SceneKind { kHead, kTurntable, kRoom, kPlane, kBlock, kEight, kCorridor };
/// Background of a head or turntable. kPlain: a dark cloth; kTextured: strong texture, static in the image;
/// kWall: a bright wall with hardly any texture, also static; kRoom: a furnished room, some metres away.
enum class BackgroundKind { kPlain, kTextured, kWall, kRoom };
enum class ShouldersKind { kNone, kStill, kSway };
/// Before the camera and fixed to it: exactly, or shaking by a pixel or two.
enum class BonnetKind { kNone, kStill, kShakes };

/// Names of images have six digits.
constexpr int kMaxFrames = 1'000'000;
/// Frames a second: with so many frames the last stamp is still one, and no two are the same.
constexpr double kMinRateHz = 1e-3, kMaxRateHz = 1e6;
/// The last whole second that a message's stamp can hold (32 bits).
constexpr double kMaxStampS = 4294967295.0;

/// What to simulate. Poses are map_from_camera; the map of the head and of the turntable scene is the
/// head's own frame.
struct SequenceOptions {
  SceneKind scene = SceneKind::kHead;
  BackgroundKind background = BackgroundKind::kPlain;
  int frames = 0;           // 0: 120 (block, eight and corridor: one every 0.25 m), or all poses of the path
  int lead_in = 0;          // frames of the background alone that come before them (head scene)
  CameraParameters camera;  // see default_camera
  bool lights_move_with_camera = true;  // as when the object turns; the room's lights are its own
  double noise_grey_levels = 0;         // standard deviation, of 255, the same in the three colours
  double blur_px = 0;                   // standard deviation of a Gaussian
  double exposure_drift = 0;            // greatest relative change of brightness, either way
  std::uint64_t seed = 1;               // of textures, path and noise
  double rate_hz = 30;
  // From the first row to the last: while it takes an image the camera moves on as its path goes. The truth
  // is of the middle row.
  double rolling_shutter_s = 0;
  double first_stamp_s = 1;                        // not 0, which ROS takes for no stamp
  int samples = 2;                                 // per pixel side
  int threads = 0;                                 // 0: as many as the machine has; no result depends on it
  bool occluder = false;                           // a hand that passes before the object
  BonnetKind bonnet = BonnetKind::kNone;           // is 0 in the masks
  ShouldersKind shoulders = ShouldersKind::kNone;  // of the head; they do not turn, and are 0 in the masks
  FaceMotionOptions face;                          // what of the head moves by itself
  double shine = 0;               // of head or bust, 0 to 1: reflections, which stay in place while it turns
  bool hand_held = false;         // the camera sways, so that what is behind the head moves too, otherwise
  std::vector<StampedPose> path;  // a path of one's own; empty: the scene's

  /// Throws std::invalid_argument naming key, value and what was expected.
  void validate() const;

 private:
  void require_what_has_it() const;
  void require_image_size() const;
};

/// Whether the map is a head's frame: the head, and the bust on a turntable.
inline bool has_head(SceneKind scene) { return scene == SceneKind::kHead || scene == SceneKind::kTurntable; }

/// Without distortion, the principal point in the middle, a focal length that suits the scene's own path.
CameraParameters default_camera(SceneKind scene, int width, int height);

class HeadStage;

struct SimulatedFrame {
  std::int64_t stamp_ns = 0;
  Rigid3 map_from_camera;  // identity in the lead-in, where there is nothing to have a pose against
  cv::Mat image;           // CV_8UC3, blue green red
  cv::Mat mask;            // CV_8UC1, 255 where the pixel's centre is on the turning object, unoccluded
};

/// A sequence whose frames are rendered on request, in any order. The seed determines each frame, whatever
/// the order and the number of threads. Const after construction: may be shared between threads.
class SimulatedSequence {
 public:
  /// Throws std::invalid_argument as SequenceOptions::validate and CameraModel do.
  explicit SimulatedSequence(const SequenceOptions& options);

  /// Frames, with those of the lead-in.
  int size() const { return options_.lead_in + static_cast<int>(path_.size()); }
  /// Ground truth: map_from_camera of each frame after the lead-in.
  const std::vector<StampedPose>& path() const { return path_; }
  const CameraModel& camera() const { return camera_; }
  /// The static part of the map: the head at rest, the room. See scene_at for the content of a frame.
  const Scene& scene() const { return *scene_; }
  /// Content of the index-th frame after the lead-in, without the background.
  std::shared_ptr<const Scene> scene_at(int index) const;

  SimulatedFrame render(int frame) const;
  std::int64_t stamp(int frame) const;  // ns

 private:
  void make_path();
  cv::Mat background(double done) const;
  void draw_object(int index, cv::Mat* color, cv::Mat* mask) const;
  std::vector<Rigid3> poses_of_bands(int index) const;
  double share_done(int index) const;
  Lighting lighting(int index) const;

  SequenceOptions options_;
  CameraModel camera_;
  std::shared_ptr<const Scene> scene_;
  std::shared_ptr<const HeadStage> stage_;  // of the scenes with a head
  Renderer renderer_;
  cv::Mat background_;  // while the camera stands still
  std::vector<StampedPose> path_;
};

}  // namespace mono_pose_tracker
