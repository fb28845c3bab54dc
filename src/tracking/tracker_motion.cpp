// The end of a recording: where the camera was when its images hardly told, since all that they saw was far.

#include <Eigen/Dense>

#include "common/so3.h"
#include "motion_smoothing.h"
#include "tracker_impl.h"

namespace mono_pose_tracker {

std::set<std::int64_t> Tracker::Impl::settle_motion() {
  if (!worker_.latest() || options_.localize_only) return {};
  const double least = least_stray(*worker_.latest());
  worker_.mapper().settle_motion(least, {});
  follow_mapper();
  const std::vector<RegisteredFrame> frames = trajectory();
  const std::vector<TimedCenter> centers = centers_of(frames);
  const MotionPrior prior(centers);
  std::set<std::int64_t> unsettled;
  for (std::size_t i = 1; i + 1 < frames.size(); ++i) {
    if (!prior.is_beyond({centers[i - 1], centers[i], centers[i + 1]}, least)) continue;
    for (std::size_t k = i - 1; k <= i + 1; ++k) unsettled.insert(frames[k].index);
  }
  for (const auto& entry : worker_.latest()->keyframes) unsettled.erase(entry.second.frame_index);
  return unsettled;
}

// The camera's turn goes with its movement, as far as the image can't tell them apart.
void Tracker::Impl::smooth(const std::set<std::int64_t>& wanted) {
  const TrackingMapPtr map = worker_.latest();
  if (wanted.empty() || !map) return;
  const std::vector<RegisteredFrame> frames = trajectory();
  const auto covariance_of = [&](std::int64_t index) -> const Matrix6d* {
    const auto posed = posed_again_.find(index);
    return wanted.count(index) == 0 || posed == posed_again_.end() ? nullptr : &posed->second;
  };
  std::vector<UncertainCenter> centers;
  for (const RegisteredFrame& frame : frames) {
    UncertainCenter center{{frame.stamp_ns, frame.map_from_camera.translation}};
    if (const Matrix6d* covariance = covariance_of(frame.index)) {
      center.covariance = covariance->topLeftCorner<3, 3>();
      center.is_held = false;
    }
    centers.push_back(center);
  }
  smooth_centers(MotionPrior(centers_of(frames)), &centers);
  FramePoses& poses = frames_.at(map->map_id);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Matrix6d* covariance = covariance_of(frames[i].index);
    const FramePose* known = poses.find(frames[i].index);
    Rigid3 reference_from_map;
    if (!covariance || !known || !map->camera_from_map(known->reference, &reference_from_map)) continue;
    const Eigen::Vector3d moved = centers[i].center - frames[i].map_from_camera.translation;
    const Eigen::Vector3d turned =
        covariance->bottomLeftCorner<3, 3>() * covariance->topLeftCorner<3, 3>().ldlt().solve(moved);
    Rigid3 map_from_camera = frames[i].map_from_camera;
    map_from_camera.translation += moved;
    map_from_camera.rotation = (exp_so3(turned) * map_from_camera.rotation).normalized();
    FramePose settled = *known;
    settled.camera_from_reference = (reference_from_map * map_from_camera).inverse();
    poses.set(frames[i].index, settled);
  }
}

}  // namespace mono_pose_tracker
