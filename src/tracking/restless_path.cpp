#include "mono_pose_tracker/tracking/restless_path.h"

#include <algorithm>

#include "mono_pose_tracker/common/median.h"

namespace mono_pose_tracker {

namespace {

constexpr double kTimesUsual = 3;

// Of all images that follow each other and between which the camera moves by `least`: a video may hold each
// image twice, and a camera rests.
double usual_step(const std::vector<PosedFrame>& frames, double least) {
  std::vector<double> steps;
  for (std::size_t i = 0; i + 1 < frames.size(); ++i) {
    if (frames[i + 1].index != frames[i].index + 1) continue;
    const double step =
        (frames[i + 1].map_from_camera.translation - frames[i].map_from_camera.translation).norm();
    if (step > least) steps.push_back(step);
  }
  return steps.empty() ? 0 : median(std::move(steps));
}

bool is_jump(const PosedFrame& before, const PosedFrame& frame, const PosedFrame& after, double limit) {
  if (after.index != before.index + 2) return false;
  const auto center = [](const PosedFrame& f) -> const Eigen::Vector3d& {
    return f.map_from_camera.translation;
  };
  return (center(after) - 2 * center(frame) + center(before)).norm() > limit;
}

}  // namespace

RestlessPath most_restless_stretch(const std::vector<PosedFrame>& trajectory, double least) {
  RestlessPath worst;
  const double limit = std::max(least, kTimesUsual * usual_step(trajectory, least));
  std::vector<int> jumps(trajectory.size(), 0);  // up to each frame
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    jumps[i] = jumps[i - 1];
    if (i + 1 < trajectory.size()) {
      jumps[i] += is_jump(trajectory[i - 1], trajectory[i], trajectory[i + 1], limit);
    }
    const std::size_t first = i > RestlessPath::kFrames ? i - RestlessPath::kFrames : 0;
    const int in_stretch = jumps[i] - jumps[first];
    if (in_stretch > worst.jumps) worst = {trajectory[first].index, in_stretch};
  }
  return worst;
}

}  // namespace mono_pose_tracker
