#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/io/trajectory.h"
#include "simulation/renderer.h"
#include "simulation/scene.h"
#include "simulation/sequence_options.h"

namespace mono_pose_tracker {

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
