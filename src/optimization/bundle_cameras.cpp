#include "bundle_cameras.h"

#include <algorithm>

namespace mono_pose_tracker {

namespace {

// Fixes the scale: of the camera farthest from the first one, the translation coordinate that a change of
// scale about the first camera changes most. With free scale, Ceres' steps diverge along the weakly
// determined directions of a narrow view (depth against rotation): heads recorded with a long lens end with
// reversed depth.
void hold_scale(const BundleProblem& problem, BundleCameras* cameras) {
  const Eigen::Vector3d first = problem.cameras[0].camera_from_map.inverse().translation;
  Eigen::Vector3d farthest = Eigen::Vector3d::Zero();
  int camera = 0;
  for (std::size_t i = 1; i < problem.cameras.size(); ++i) {
    const Eigen::Vector3d moved = problem.cameras[i].camera_from_map * first;
    if (moved.norm() > farthest.norm()) farthest = moved, camera = static_cast<int>(i);
  }
  int coordinate = 0;
  farthest.cwiseAbs().maxCoeff(&coordinate);
  if (std::binary_search(cameras->free.begin(), cameras->free.end(), camera))
    cameras->states[camera].held = 3 + coordinate;
}

}  // namespace

BundleCameras::BundleCameras(const BundleProblem& problem)
    : blocks(problem.cameras.size()), states(problem.cameras.size()), used(problem.cameras.size(), 0) {
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Rigid3& pose = problem.cameras[i].camera_from_map;
    blocks[i] = {};
    states[i].start_rotation = pose.rotation_matrix();
    states[i].start_translation = pose.translation;
    states[i].update(blocks[i].data());
  }
  for (const BundleObservation& o : problem.observations) used[o.camera] = 1;
  const bool held_by_others = std::any_of(problem.cameras.begin(), problem.cameras.end(),
                                          [](const BundleCamera& c) { return c.constant; });
  for (std::size_t i = held_by_others ? 0 : 1; i < blocks.size(); ++i) {
    if (used[i] && !problem.cameras[i].constant) free.push_back(static_cast<int>(i));
  }
  if (!held_by_others) hold_scale(problem, this);
}

Rigid3 BundleCameras::pose(std::size_t camera) const {
  CameraState state = states[camera];
  state.update(blocks[camera].data());
  return {Eigen::Quaterniond(state.rotation).normalized(), state.translation};
}

}  // namespace mono_pose_tracker
