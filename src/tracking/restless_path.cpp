#include "mono_pose_tracker/tracking/restless_path.h"

#include <algorithm>
#include <limits>

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

bool is_in_a_row(const std::vector<PosedFrame>& frames, std::size_t i) {
  return i > 0 && i + 1 < frames.size() && frames[i + 1].index == frames[i - 1].index + 2;
}

// By how much the velocity changes at each image that has one before and one after it; elsewhere not at all.
std::vector<Eigen::Vector3d> changes_of_velocity(const std::vector<PosedFrame>& frames) {
  std::vector<Eigen::Vector3d> changes(frames.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 1; i + 1 < frames.size(); ++i) {
    if (!is_in_a_row(frames, i)) continue;
    changes[i] = frames[i + 1].map_from_camera.translation - 2 * frames[i].map_from_camera.translation +
                 frames[i - 1].map_from_camera.translation;
  }
  return changes;
}

// Where it changes by more than the limit, and back again with the next image, or had before.
std::vector<char> jumps_of(const std::vector<PosedFrame>& frames, double least) {
  const double limit = std::max(least, kTimesUsual * usual_step(frames, least));
  const std::vector<Eigen::Vector3d> changes = changes_of_velocity(frames);
  std::vector<char> jumps(frames.size(), 0);
  for (std::size_t i = 1; i < frames.size(); ++i) {
    if (std::min(changes[i - 1].norm(), changes[i].norm()) <= limit) continue;
    if (changes[i - 1].dot(changes[i]) < 0) jumps[i - 1] = jumps[i] = 1;
  }
  return jumps;
}

std::size_t begin_of_stretch(std::size_t end) {
  return end > RestlessPath::kFrames ? end - RestlessPath::kFrames : 0;
}

// Those in the stretch that ends with each frame.
std::vector<int> jumps_in_stretches(const std::vector<char>& is_jump) {
  std::vector<int> up_to(is_jump.size(), 0), in_stretch(is_jump.size(), 0);
  for (std::size_t i = 1; i < is_jump.size(); ++i) {
    up_to[i] = up_to[i - 1] + is_jump[i];
    in_stretch[i] = up_to[i] - up_to[begin_of_stretch(i)];
  }
  return in_stretch;
}

}  // namespace

RestlessPath most_restless_stretch(const std::vector<PosedFrame>& trajectory, double least,
                                   const SeenSteps& seen) {
  RestlessPath worst;
  std::vector<char> is_jump = jumps_of(trajectory, least);
  for (std::size_t i = 0; i + 1 < trajectory.size(); ++i) {
    const auto before = seen.find(trajectory[i].index), after = seen.find(trajectory[i + 1].index);
    if (before != seen.end() && after != seen.end() && (before->second || after->second)) is_jump[i] = 0;
  }
  const std::vector<int> jumps = jumps_in_stretches(is_jump);
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    if (jumps[i] <= worst.jumps) continue;
    worst = {trajectory[begin_of_stretch(i)].index, jumps[i]};
  }
  return worst;
}

double greatest_leap(const std::vector<PosedFrame>& trajectory) {
  const std::vector<Eigen::Vector3d> changes = changes_of_velocity(trajectory);
  std::vector<double> sizes;
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    if (is_in_a_row(trajectory, i)) sizes.push_back(changes[i].norm());
  }
  constexpr std::size_t kTenth = 10;
  if (sizes.size() < kTenth) return 0;
  std::sort(sizes.begin(), sizes.end());
  const double most = sizes[sizes.size() - 1 - sizes.size() / kTenth];
  return most > 0 ? sizes.back() / most : std::numeric_limits<double>::infinity();
}

std::set<std::int64_t> frames_at_jumps(const std::vector<PosedFrame>& trajectory, double least) {
  const std::vector<char> is_jump = jumps_of(trajectory, least);
  const std::vector<int> jumps = jumps_in_stretches(is_jump);
  std::set<std::int64_t> frames;
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    if (jumps[i] <= RestlessPath::kMostOfARightPath) continue;
    for (std::size_t k = begin_of_stretch(i); k <= i; ++k) {
      if (is_jump[k] == 0) continue;
      for (std::int64_t step = -1; step <= 1; ++step) frames.insert(trajectory[k].index + step);
    }
  }
  return frames;
}

}  // namespace mono_pose_tracker
