#include "mono_pose_tracker/tracking/restless_path.h"

#include <algorithm>

#include "mono_pose_tracker/common/median.h"

namespace mono_pose_tracker {

namespace {

constexpr double kTimesUsual = 3;

// Between images that follow each other.
struct Steps {
  std::vector<double> all;
  std::vector<Eigen::Vector3d> moved;  // those longer than `least`
  int in_a_row = 0;                    // of these: right after another
};

Steps steps_of(const std::vector<PosedFrame>& frames, double least) {
  Steps steps;
  std::size_t last_moved = frames.size();
  for (std::size_t i = 0; i + 1 < frames.size(); ++i) {
    if (frames[i + 1].index != frames[i].index + 1) continue;
    const Eigen::Vector3d step =
        frames[i + 1].map_from_camera.translation - frames[i].map_from_camera.translation;
    steps.all.push_back(step.norm());
    if (step.norm() <= least) continue;
    steps.moved.push_back(step);
    steps.in_a_row += last_moved + 1 == i;
    last_moved = i;
  }
  return steps;
}

// Whether a video holds each image two or three times: the camera stands after every step, and goes on with
// the next. One that jumps to and fro goes back after each jump.
bool holds_images_again(const Steps& steps) {
  constexpr double kMostInARow = 0.1, kLeastOnward = 2.0 / 3;  // shares of the steps between which it moves
  const auto moved = static_cast<double>(steps.moved.size());
  int onward = 0;
  for (std::size_t i = 0; i + 1 < steps.moved.size(); ++i)
    onward += steps.moved[i].dot(steps.moved[i + 1]) > 0;
  return steps.in_a_row <= kMostInARow * moved && onward > kLeastOnward * moved;
}

// Of all images that follow each other; where they are there again and again, of those between which it
// moves.
double usual_step(const std::vector<PosedFrame>& frames, double least) {
  Steps steps = steps_of(frames, least);
  if (!holds_images_again(steps)) return median(std::move(steps.all));
  std::vector<double> moved;
  for (const Eigen::Vector3d& step : steps.moved) moved.push_back(step.norm());
  return median(std::move(moved));
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
