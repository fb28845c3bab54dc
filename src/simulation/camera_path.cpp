#include "simulation/camera_path.h"

#include <cmath>

#include "common/rotation.h"
#include "common/statistics.h"

namespace mono_pose_tracker {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

/// 0 to 1 as s goes from 0 to 1, starting and stopping gently.
double ease(double s) { return 0.5 - 0.5 * std::cos(kPi * std::min(std::max(s, 0.0), 1.0)); }

double share_done(int frame, int frames) {
  return frames > 1 ? static_cast<double>(frame) / (frames - 1) : 0.0;
}

/// Camera at `position` that looks at `target`, its image upright in a map with z up.
Rigid3 looking_at(const Vector3d& position, const Vector3d& target) {
  Eigen::Matrix3d map_from_camera;
  map_from_camera.col(2) = (target - position).normalized();
  map_from_camera.col(0) = map_from_camera.col(2).cross(Vector3d::UnitZ()).normalized();
  map_from_camera.col(1) = map_from_camera.col(2).cross(map_from_camera.col(0));
  return {map_from_camera, position};
}

/// From start to end on a bow, swaying by centimetres, shaking by millimetres and tenths of a degree.
std::vector<Rigid3> handheld_path(int frames, std::uint64_t seed, const Vector3d& start, const Vector3d& end,
                                  const Vector3d& bow, const Vector3d& target) {
  Random random(seed);
  const Wander3 sway(0.5, 2.0, &random), shake(5, 14, &random), glance(0.5, 1.5, &random),
      twitch(5, 14, &random);
  std::vector<Rigid3> path;
  path.reserve(frames);
  for (int frame = 0; frame < frames; ++frame) {
    const double s = share_done(frame, frames);
    const Vector3d position =
        start + s * (end - start) + std::sin(kPi * s) * bow + 0.02 * sway(s) + 0.002 * shake(s);
    Rigid3 pose = looking_at(position, target + 0.15 * glance(s));
    pose.rotation = (pose.rotation * exp_so3(0.3 * kDegree * twitch(s))).normalized();
    path.push_back(pose);
  }
  return path;
}

}  // namespace

std::vector<Rigid3> head_path(int frames, double distance, std::uint64_t seed) {
  Random random(seed);
  const Wander3 sway(0.5, 3.0, &random), tilt(0.5, 3.0, &random);
  const Vector3d neck(0, 0.06, 0.02);  // m in the head's frame: what the head turns about
  std::vector<Rigid3> path;
  path.reserve(frames);
  for (int frame = 0; frame < frames; ++frame) {
    // Of the 120 frames of the paper's sequence 40 each for: right, back, down.
    const double third = 3 * share_done(frame, frames);
    const double yaw = 45 * kDegree * (third < 1 ? ease(third) : ease(2 - third));
    const double pitch = 20 * kDegree * ease(third - 2);
    // Its own right is the image's left; the camera's x is to the right, y down.
    const Eigen::Quaterniond turn = AngleAxisd(yaw, Vector3d::UnitY()) *
                                    AngleAxisd(pitch, Vector3d::UnitX()) *
                                    exp_so3(0.4 * kDegree * tilt(third / 3));
    const Vector3d neck_in_camera = neck + Vector3d(0, 0, distance) + 0.0015 * sway(third / 3);
    const Rigid3 camera_from_head(turn, neck_in_camera - turn * neck);
    path.push_back(camera_from_head.inverse());
  }
  return path;
}

std::vector<Rigid3> turntable_path(int frames, double distance) {
  const Vector3d on_axis(0, 0.05, 0.03);
  const Eigen::Quaterniond down(AngleAxisd(-15 * kDegree, Vector3d::UnitX()));
  const Rigid3 stage_from_camera(down, on_axis - distance * (down * Vector3d::UnitZ()));
  std::vector<Rigid3> path;
  path.reserve(frames);
  for (int frame = 0; frame < frames; ++frame) {
    const Eigen::Quaterniond turn(AngleAxisd(344 * kDegree * share_done(frame, frames), Vector3d::UnitY()));
    const Rigid3 stage_from_map(turn, on_axis - turn * on_axis);
    path.push_back(stage_from_map.inverse() * stage_from_camera);
  }
  return path;
}

std::vector<Rigid3> handheld_room_path(int frames, std::uint64_t seed) {
  return handheld_path(frames, seed, {-0.25, 1.2, 1.35}, {0.25, 1.35, 1.45}, {0, 0.08, 0.06},
                       {0.05, 4.2, 0.95});
}

std::vector<Rigid3> room_lap(int frames) {
  std::vector<Rigid3> path;
  path.reserve(frames);
  for (int frame = 0; frame < frames; ++frame) {
    const double a = 2 * kPi * frame / frames;
    const Vector3d position(0.35 * std::cos(a), 1.3 + 0.15 * std::sin(2 * a), 1.4 + 0.12 * std::sin(a));
    path.push_back(looking_at(position, {0.4 * std::sin(a), 4.2, 0.95 + 0.15 * std::cos(2 * a)}));
  }
  return path;
}

std::vector<Rigid3> handheld_plane_path(int frames, std::uint64_t seed) {
  return handheld_path(frames, seed, {-0.3, -2.1, 0.1}, {0.25, -1.85, -0.05}, {0, 0.1, 0.1}, {0, 0, 0});
}

}  // namespace mono_pose_tracker
