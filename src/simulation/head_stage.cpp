#include "simulation/head_stage.h"

#include "common/random.h"
#include "common/rotation.h"
#include "simulation/camera_path.h"
#include "simulation/composite_scene.h"
#include "simulation/head_scene.h"
#include "simulation/torso_scene.h"
#include "simulation/turntable_scene.h"

namespace mono_pose_tracker {
namespace {

using Eigen::Vector3d;

/// From the camera to the middle of the head, m: the head fills three quarters of the image's height, or,
/// that its shoulders are in the image, half of it.
constexpr double kHeadDistance = 0.55, kPortraitDistance = 0.85, kTurntableDistance = 0.80;

/// A wandering from a stream of its own.
Wander3 wander(std::uint64_t seed, std::uint64_t use, double slowest, double fastest) {
  Random random(seed + 0x9e3779b97f4a7c15ull * use);
  return {slowest, fastest, &random};
}

/// The room's z is up; the head is a man's, seated in its middle.
Rigid3 room_from_stage() {
  Eigen::Matrix3d rotation;
  rotation << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return {rotation, Vector3d(0, 1.9, 1.25)};
}

}  // namespace

HeadStage::HeadStage(const SequenceOptions& options, std::uint32_t texture_seed, std::uint64_t motion_seed)
    : options_(options),
      texture_seed_(texture_seed),
      motion_seed_(motion_seed),
      room_(make_room_scene(texture_seed + 1)),
      torso_sway_(wander(motion_seed, 1, 0.7, 2.5)),
      torso_tilt_(wander(motion_seed, 2, 0.7, 2.5)),
      hand_sway_(wander(motion_seed, 3, 0.5, 2.0)),
      hand_shake_(wander(motion_seed, 4, 5, 14)),
      hand_turn_(wander(motion_seed, 5, 0.5, 2.5)) {}

std::vector<Rigid3> HeadStage::path(int frames, std::uint64_t seed) const {
  const bool turntable = options_.scene == SceneKind::kTurntable;
  const double distance = options_.shoulders == ShouldersKind::kNone ? kHeadDistance : kPortraitDistance;
  std::vector<Rigid3> path =
      turntable ? turntable_path(frames, kTurntableDistance) : head_path(frames, distance, seed);
  if (!options_.hand_held) return path;
  for (int i = 0; i < frames; ++i) {
    path[i] = path[i] * rest_from_camera(frames > 1 ? static_cast<double>(i) / (frames - 1) : 0);
  }
  return path;
}

// As someone holds it who keeps the head in view: decimetres, degrees.
Rigid3 HeadStage::rest_from_camera(double done) const {
  if (!options_.hand_held) return {};
  const Vector3d position = 0.10 * hand_sway_(done) + 0.002 * hand_shake_(done);
  const double distance = -stage_from_rest().translation.z();
  // Turned back towards the head for most of what the hand goes to the side.
  const Vector3d back(position.y() / distance, -position.x() / distance, 0);
  return {exp_so3(0.8 * back + 1.5 * kDegree * hand_turn_(done)), position};
}

Rigid3 HeadStage::stage_from_rest() const {
  if (options_.scene == SceneKind::kTurntable) return turntable_path(1, kTurntableDistance).front();
  const bool shoulders = options_.shoulders != ShouldersKind::kNone;
  return {Eigen::Quaterniond::Identity(), Vector3d(0, 0, shoulders ? -kPortraitDistance : -kHeadDistance)};
}

Rigid3 HeadStage::room_from_camera(double done) const {
  return room_from_stage() * stage_from_rest() * rest_from_camera(done);
}

// By a centimetre and some degrees about the seat.
Rigid3 HeadStage::stage_from_torso(double done) const {
  if (options_.shoulders != ShouldersKind::kSway) return {};
  const Vector3d seat(0, 0.6, 0.05);
  const Eigen::Quaterniond tilt = exp_so3(4 * kDegree * torso_tilt_(done));
  return {tilt, seat - tilt * seat + 0.012 * torso_sway_(done)};
}

std::shared_ptr<const Scene> HeadStage::scene(const Rigid3& map_from_camera, double done, double time) const {
  const bool shoulders = options_.shoulders != ShouldersKind::kNone;
  HeadLook look = face_look(options_.face, motion_seed_, time);
  look.neck = !shoulders;
  look.shine = static_cast<float>(options_.shine);
  auto head = std::make_shared<HeadScene>(texture_seed_, look);
  std::vector<CompositeScene::Part> parts = {{head, Rigid3(), true}};
  if (shoulders) {
    const Rigid3 stage_from_map = stage_from_rest() * rest_from_camera(done) * map_from_camera.inverse();
    const Rigid3 torso_from_map = stage_from_torso(done).inverse() * stage_from_map;
    parts.push_back({std::make_shared<TorsoScene>(texture_seed_, torso_from_map), torso_from_map, false});
  }
  if (options_.scene == SceneKind::kTurntable)
    parts.push_back({std::make_shared<TurntableScene>(texture_seed_ + 60), Rigid3(), true});
  if (parts.size() == 1) return head;
  return std::make_shared<CompositeScene>(std::move(parts));
}

}  // namespace mono_pose_tracker
