#include "simulation/head_stage.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "common/rotation.h"
#include "common/statistics.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "simulation/camera_path.h"
#include "simulation/head_scene.h"
#include "simulation/ray_march.h"
#include "simulation/scene.h"
#include "simulation/texture.h"

namespace mono_pose_tracker {
namespace {

/// Scenes with frames of their own at one moment, rendered together: a head and the shoulders below it.
class CompositeScene : public Scene {
 public:
  struct Part {
    std::shared_ptr<const Scene> scene;
    Rigid3 part_from_map;
    bool is_object;  // whether it may belong to the tracked object; its scene decides where
  };

  /// Parts have fewer than 1000 surfaces each.
  explicit CompositeScene(std::vector<Part> parts) : parts_(std::move(parts)) {}

  bool intersect(const Ray& ray, double start, Hit* hit) const override;
  double free_distance(const Ray& axis, double slope) const override;
  Color albedo(const Hit& hit, const Eigen::Vector3d& x_in_map, float footprint) const override;
  Color irradiance(const Hit& hit, const Eigen::Vector3d& x_in_map, const Lighting& lighting) const override;
  Color gloss(const Hit& hit, const Eigen::Vector3d& x_in_map, const Eigen::Vector3d& to_camera,
              const Lighting& lighting) const override;
  bool is_object(const Hit& hit) const override;

 private:
  const Part& part_of(const Hit& hit) const;

  std::vector<Part> parts_;
};

using Eigen::Vector3d;

constexpr int kSurfaces = 1000;  // of a part: its numbers are part * kSurfaces + its own

Ray in_part(const Rigid3& part_from_map, const Ray& ray) {
  return {part_from_map * ray.origin, part_from_map.rotation * ray.direction};
}

Hit in_part(const Rigid3& part_from_map, const Hit& hit) {
  return {hit.distance, part_from_map.rotation * hit.normal_in_map, hit.surface % kSurfaces};
}

Lighting in_part(const Rigid3& part_from_map, const Lighting& lighting) {
  const Eigen::Quaternionf rotation = part_from_map.rotation.cast<float>();
  return {rotation * lighting.key_direction_in_map, rotation * lighting.fill_direction_in_map};
}

const CompositeScene::Part& CompositeScene::part_of(const Hit& hit) const {
  return parts_[hit.surface / kSurfaces];
}

bool CompositeScene::intersect(const Ray& ray, double start, Hit* hit) const {
  hit->distance = std::numeric_limits<double>::infinity();
  bool found = false;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const Rigid3& part_from_map = parts_[i].part_from_map;
    Hit own;
    if (!parts_[i].scene->intersect(in_part(part_from_map, ray), start, &own)) continue;
    if (own.distance >= hit->distance) continue;
    *hit = {own.distance, part_from_map.rotation.conjugate() * own.normal_in_map,
            static_cast<int>(i) * kSurfaces + own.surface};
    found = true;
  }
  return found;
}

double CompositeScene::free_distance(const Ray& axis, double slope) const {
  double free = std::numeric_limits<double>::infinity();
  for (const Part& part : parts_) {
    free = std::min(free, part.scene->free_distance(in_part(part.part_from_map, axis), slope));
  }
  return free;
}

Color CompositeScene::albedo(const Hit& hit, const Vector3d& x_in_map, float footprint) const {
  const Part& part = part_of(hit);
  return part.scene->albedo(in_part(part.part_from_map, hit), part.part_from_map * x_in_map, footprint);
}

Color CompositeScene::irradiance(const Hit& hit, const Vector3d& x_in_map, const Lighting& lighting) const {
  const Part& part = part_of(hit);
  return part.scene->irradiance(in_part(part.part_from_map, hit), part.part_from_map * x_in_map,
                                in_part(part.part_from_map, lighting));
}

Color CompositeScene::gloss(const Hit& hit, const Vector3d& x_in_map, const Vector3d& to_camera,
                            const Lighting& lighting) const {
  const Part& part = part_of(hit);
  return part.scene->gloss(in_part(part.part_from_map, hit), part.part_from_map * x_in_map,
                           part.part_from_map.rotation * to_camera, in_part(part.part_from_map, lighting));
}

bool CompositeScene::is_object(const Hit& hit) const {
  const Part& part = part_of(hit);
  return part.is_object && part.scene->is_object(in_part(part.part_from_map, hit));
}

/// Shoulders in a shirt and the neck, at one moment. The torso's frame is that of the head at rest. The neck
/// is not rigid: it bends from the torso to the head, and its skin turns with the head in proportion to its
/// nearness.
class TorsoScene : public Scene {
 public:
  TorsoScene(std::uint32_t seed, const Rigid3& torso_from_head);

  bool intersect(const Ray& ray, double start, Hit* hit) const override;
  double free_distance(const Ray& axis, double slope) const override;
  Color albedo(const Hit& hit, const Eigen::Vector3d& x_in_torso, float footprint) const override;
  Color irradiance(const Hit& hit, const Eigen::Vector3d& x_in_torso,
                   const Lighting& lighting) const override;

 private:
  double distance(const Eigen::Vector3d& x) const;
  Eigen::Vector3d skin_place(const Eigen::Vector3d& x) const;

  std::uint32_t seed_;
  Rigid3 torso_from_head_;
  Eigen::Vector3d neck_top_;
};

using Eigen::Vector3f;

enum TorsoSurface { kShirt, kSkin };

const Ball kTorsoBall{{0, 0.40, 0.05}, 0.44};
const Vector3d kNeckBase(0, 0.200, 0.050), kNeckTopInHead(0, 0.045, 0.028);
const Ellipsoid kChest({0, 0.43, 0.060}, {0.185, 0.250, 0.115});

/// Without the neck; symmetric.
double trunk(const Vector3d& x) {
  const Vector3d p(std::sqrt(x.x() * x.x() + 9e-6), x.y(), x.z());
  double d = ellipsoid(p, kChest);
  d = blend(d, tapered_capsule(p, {0.03, 0.175, 0.060}, {0.135, 0.243, 0.060}, 0.036, 0.046), 0.06);
  d = blend(d, tapered_capsule(p, {0.10, 0.270, 0.055}, {0.172, 0.285, 0.055}, 0.060, 0.058), 0.04);
  return blend(d, tapered_capsule(p, {0.188, 0.30, 0.055}, {0.225, 0.60, 0.045}, 0.052, 0.045), 0.03);
}

/// Signed distance (m, about) beyond the edge of a round collar, negative where skin shows.
double beyond_collar(const Vector3d& x) {
  const double slope = 0.030 * smooth_step(0.06f, -0.04f, static_cast<float>(x.z()));  // lower in front
  return std::hypot(x.x(), 0.8 * (x.z() - 0.045)) + 1.6 * (x.y() - 0.195 - slope) - 0.064;
}

/// A striped knit: wide bands, a yarn of two greys, and creases.
Vector3f cloth(unsigned seed, const Vector3f& x, float footprint) {
  const float softness = 0.0012f + footprint;
  const float band = 0.026f, phase = x.y() / band - std::floor(x.y() / band);
  const float stripe =
      smooth_step(0, softness / band, phase) * smooth_step(0.32f, 0.32f - softness / band, phase);
  const Vector3f base(0.17f, 0.21f, 0.30f), light(0.60f, 0.57f, 0.50f);
  const float yarn = fractal_noise(seed, x.x(), x.y(), x.z(), 0.005f, 3, footprint);
  const float crease = fractal_noise(seed + 1, 0.4f * x.x(), 1.4f * x.y(), x.z(), 0.05f, 3, footprint);
  return (base + stripe * (light - base)) * (1.f + 0.28f * yarn + 0.20f * crease);
}

TorsoScene::TorsoScene(std::uint32_t seed, const Rigid3& torso_from_head)
    : seed_(seed), torso_from_head_(torso_from_head), neck_top_(torso_from_head * kNeckTopInHead) {}

double TorsoScene::distance(const Vector3d& x) const {
  const double outside = (x - kTorsoBall.centre).norm() - kTorsoBall.radius;
  if (outside > 0.05) return outside;
  return blend(trunk(x), tapered_capsule(x, neck_top_, kNeckBase, 0.050, 0.057), 0.03);
}

bool TorsoScene::intersect(const Ray& ray, double start, Hit* hit) const {
  const auto field = [this](const Vector3d& x) { return distance(x); };
  if (!intersect_field(field, kTorsoBall, ray, start, hit)) return false;
  const Vector3d x = ray.origin + hit->distance * ray.direction;
  hit->surface = beyond_collar(x) > 0 ? kShirt : kSkin;
  return true;
}

double TorsoScene::free_distance(const Ray& axis, double slope) const {
  return march_cone([this](const Vector3d& x) { return distance(x); }, kTorsoBall, axis, slope);
}

// Where this place of the skin is in the head's frame when the head is at rest.
Vector3d TorsoScene::skin_place(const Vector3d& x) const {
  const Vector3d axis = neck_top_ - kNeckBase;
  const double s = std::clamp((x - kNeckBase).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
  const Eigen::Quaterniond turned = Eigen::Quaterniond::Identity().slerp(s, torso_from_head_.rotation);
  const Vector3d on_axis = kNeckBase + s * axis, at_rest = kNeckBase + s * (kNeckTopInHead - kNeckBase);
  return at_rest + turned.conjugate() * (x - on_axis);
}

Color TorsoScene::albedo(const Hit& hit, const Vector3d& x, float footprint) const {
  if (hit.surface == kSkin) return head_albedo(seed_, {}, skin_place(x).cast<float>(), footprint);
  const float edge = smooth_step(0.010f, 0.008f, static_cast<float>(beyond_collar(x)));
  return cloth(seed_ + 40, x.cast<float>(), footprint) * (1.f - 0.45f * edge);  // the collar's edge
}

Color TorsoScene::irradiance(const Hit& hit, const Vector3d& x, const Lighting& lighting) const {
  // The chin darkens the neck, the head the shoulders.
  constexpr double kBreadth = 0.03;
  const Vector3d off = x + kBreadth * hit.normal_in_map;
  const double head = head_distance(torso_from_head_.inverse() * off, false);
  return skin_light(hit.normal_in_map.cast<float>(), std::min(distance(off), head) / kBreadth, lighting);
}

/// The top of a turntable, and the plinth below it, which does not turn. Its frame is that of the head that
/// stands on it.
class TurntableScene : public Scene {
 public:
  explicit TurntableScene(std::uint32_t seed) : seed_(seed) {}

  bool intersect(const Ray& ray, double start, Hit* hit) const override;
  double free_distance(const Ray& axis, double slope) const override;
  Color albedo(const Hit& hit, const Eigen::Vector3d& x, float footprint) const override;
  Color irradiance(const Hit& hit, const Eigen::Vector3d& x, const Lighting& lighting) const override;
  bool is_object(const Hit& hit) const override;

 private:
  std::uint32_t seed_;
};

enum TurntableSurface { kTop, kPlinth };

const Ball kTableBall{{0, 0.36, 0.03}, 0.36};
const Vector3d kAxis(0, 0, 0.03);  // what turns turns about the upright line through here
constexpr double kTopLevel = 0.19, kTopThickness = 0.02, kTopRadius = 0.19;  // m
constexpr double kPlinthLevel = kTopLevel + kTopThickness,
                 kPlinthRadius = 0.15;  // m, above what of the neck is below

double top_distance(const Vector3d& x) {
  return flat_cylinder(x - kAxis, kTopLevel, kTopRadius, kTopThickness);
}

double table_distance(const Vector3d& x) {
  return std::min(top_distance(x), flat_cylinder(x - kAxis, kPlinthLevel, kPlinthRadius, 0.5));
}

bool TurntableScene::intersect(const Ray& ray, double start, Hit* hit) const {
  if (!intersect_field(table_distance, kTableBall, ray, start, hit)) return false;
  hit->surface = top_distance(ray.origin + hit->distance * ray.direction) < 1e-5 ? kTop : kPlinth;
  return true;
}

double TurntableScene::free_distance(const Ray& axis, double slope) const {
  return march_cone(table_distance, kTableBall, axis, slope);
}

// A worn wooden top; a plinth in one colour, that shows no texture which could tell whether it turns.
Color TurntableScene::albedo(const Hit& hit, const Vector3d& x, float footprint) const {
  if (hit.surface == kPlinth) return {0.30f, 0.31f, 0.33f};
  const Vector3f p = x.cast<float>();
  const float grain = fractal_noise(seed_, 0.25f * p.x(), p.y(), p.z(), 0.008f, 4, footprint);
  const float stain = fractal_noise(seed_ + 1, p.x(), p.y(), p.z(), 0.05f, 4, footprint);
  const float scratch = fractal_noise(seed_ + 2, p.x(), p.y(), 0.3f * p.z(), 0.003f, 2, footprint);
  return Color(0.52f, 0.40f, 0.27f) * std::max(0.2f, 1.f + 0.22f * grain + 0.20f * stain + 0.15f * scratch);
}

Color TurntableScene::irradiance(const Hit& hit, const Vector3d& x, const Lighting& lighting) const {
  constexpr double kBreadth = 0.03;
  const double head =
      head_distance(x + kBreadth * hit.normal_in_map) / kBreadth;  // which darkens what is below it
  return skin_light(hit.normal_in_map.cast<float>(), head, lighting);
}

bool TurntableScene::is_object(const Hit& hit) const { return hit.surface == kTop; }

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
