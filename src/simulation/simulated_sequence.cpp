#include "simulation/simulated_sequence.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/random.h"
#include "common/rotation.h"
#include "common/threads.h"
#include "common/time_stamp.h"
#include "simulation/bonnet.h"
#include "simulation/camera_path.h"
#include "simulation/hand_occluder.h"
#include "simulation/head_scene.h"
#include "simulation/head_stage.h"
#include "simulation/panel_scene.h"
#include "simulation/sensor.h"
#include "simulation/static_background.h"
#include "street_scene.h"

namespace mono_pose_tracker {
namespace {

constexpr int kFrames = 120;  // of the paper's sequence
/// A stream of its own for each use of the sequence's seed.
std::uint64_t derived_seed(std::uint64_t seed, std::uint64_t use) {
  return Random(seed * 0x2545f4914f6cdd1dull + use).next();
}

int thread_count(int asked) { return asked > 0 ? asked : processors(); }

StreetPlan street_plan(SceneKind kind) {
  constexpr double kOverlap = 15;  // m
  if (kind == SceneKind::kBlock) return block_plan(kOverlap);
  return kind == SceneKind::kEight ? figure_eight_plan() : corridor_plan();
}

std::shared_ptr<const Scene> make_scene(SceneKind kind, std::uint64_t seed) {
  const auto texture_seed = static_cast<std::uint32_t>(derived_seed(seed, 0));
  switch (kind) {
    case SceneKind::kRoom:
      return std::make_shared<PanelScene>(make_room_scene(texture_seed));
    case SceneKind::kPlane:
      return std::make_shared<PanelScene>(make_plane_scene(texture_seed));
    case SceneKind::kBlock:
    case SceneKind::kEight:
    case SceneKind::kCorridor:
      return std::make_shared<PanelScene>(make_street_scene(street_plan(kind), texture_seed));
    default:
      return std::make_shared<HeadScene>(texture_seed);
  }
}

// frames 0: as many as suit the scene; `stage`: of a scene with a head.
std::vector<Rigid3> scene_path(SceneKind kind, const HeadStage* stage, int frames, std::uint64_t seed) {
  const int some = frames > 0 ? frames : kFrames;
  switch (kind) {
    case SceneKind::kRoom:
      return handheld_room_path(some, seed);
    case SceneKind::kPlane:
      return handheld_plane_path(some, seed);
    case SceneKind::kBlock:
    case SceneKind::kEight:
    case SceneKind::kCorridor:
      return street_path(street_plan(kind), frames, seed);
    default:
      return stage->path(some, seed);
  }
}

Lighting room_lighting() {
  return {Eigen::Vector3f(-0.4f, -0.5f, 0.75f).normalized(), -Eigen::Vector3f::UnitY()};
}

// Where the camera is so long after the index-th pose of a path, at the speed at which it goes to the next
// one then, or comes from the one before; beyond the ends it goes on.
Rigid3 moved(const std::vector<StampedPose>& path, int index, double seconds) {
  const int last = static_cast<int>(path.size()) - 1;
  const int from = std::clamp(seconds < 0 ? index - 1 : index, 0, last - 1);
  const Rigid3 &pose = path[index].map_from_camera, &a = path[from].map_from_camera,
               &b = path[from + 1].map_from_camera;
  const double share = 1e9 * seconds / static_cast<double>(path[from + 1].stamp_ns - path[from].stamp_ns);
  const Eigen::AngleAxisd turn(a.rotation.conjugate() * b.rotation);
  Rigid3 there;
  there.rotation = pose.rotation * Eigen::AngleAxisd(share * turn.angle(), turn.axis());
  there.translation = pose.translation + share * (b.translation - a.translation);
  return there;
}

std::int64_t nanoseconds(double seconds) { return std::llround(1e9 * seconds); }

}  // namespace

SimulatedSequence::SimulatedSequence(const SequenceOptions& options)
    : options_((options.validate(), options)),
      camera_(options.camera),
      scene_(make_scene(options.scene, options.seed)),
      renderer_(camera_, options.samples, thread_count(options.threads)) {
  options_.threads = thread_count(options.threads);
  if (has_head(options_.scene)) {
    stage_ = std::make_shared<HeadStage>(options_, static_cast<std::uint32_t>(derived_seed(options_.seed, 0)),
                                         derived_seed(options_.seed, 4));
  }
  make_path();
  background_ = background(0);
  if (options_.lead_in > 0 && stamp(0) < 0) {
    throw std::invalid_argument("lead_in = " + std::to_string(options_.lead_in) +
                                ", expected one that fits between time 0 and the path's first stamp");
  }
}

void SimulatedSequence::make_path() {
  if (!options_.path.empty()) {
    path_ = options_.path;
    if (options_.frames > 0 && options_.frames < static_cast<int>(path_.size()))
      path_.resize(options_.frames);
    return;
  }
  std::int64_t index = 0;
  const std::uint64_t path_seed = derived_seed(options_.seed, 2);
  for (const Rigid3& pose : scene_path(options_.scene, stage_.get(), options_.frames, path_seed)) {
    path_.push_back(
        {nanoseconds(options_.first_stamp_s + (options_.lead_in + index++) / options_.rate_hz), pose});
  }
}

// What is behind the head.
cv::Mat SimulatedSequence::background(double done) const {
  const auto texture_seed = static_cast<std::uint32_t>(derived_seed(options_.seed, 1));
  cv::Mat still = static_background(camera_, options_.background, texture_seed, options_.threads);
  if (options_.background != BackgroundKind::kRoom) return still;
  return renderer_.render(stage_->room(), stage_->room_from_camera(done), room_lighting(), still).color;
}

std::shared_ptr<const Scene> SimulatedSequence::scene_at(int index) const {
  if (!stage_) return scene_;
  const double time = seconds_between(path_.front().stamp_ns, path_.at(index).stamp_ns);
  return stage_->scene(path_.at(index).map_from_camera, share_done(index), time);
}

Lighting SimulatedSequence::lighting(int index) const {
  if (!stage_) return room_lighting();
  // A lamp to the upper left of the camera, a window to its right.
  const Eigen::Vector3f key = Eigen::Vector3f(-0.5f, -0.75f, -0.8f).normalized();
  const Eigen::Vector3f fill = Eigen::Vector3f(0.4f, -0.3f, -0.8f).normalized();
  if (!options_.lights_move_with_camera) return {key, fill};
  // They stand still with the camera's place of rest.
  const Rigid3& map_from_camera = path_.at(index).map_from_camera;
  const Rigid3 map_from_rest = options_.hand_held
                                   ? map_from_camera * stage_->rest_from_camera(share_done(index)).inverse()
                                   : map_from_camera;
  const Eigen::Matrix3f rotation = map_from_rest.rotation_matrix().cast<float>();
  return {rotation * key, rotation * fill};
}

// While the rows are read, from above.
std::vector<Rigid3> SimulatedSequence::poses_of_bands(int index) const {
  std::vector<Rigid3> poses(renderer_.bands(), path_.at(index).map_from_camera);
  if (options_.rolling_shutter_s == 0 || path_.size() < 2) return poses;
  for (std::size_t band = 0; band < poses.size(); ++band) {
    const double row = std::min((band + 0.5) * Renderer::kBandRows, camera_.height() - 0.5);
    poses[band] = moved(path_, index, options_.rolling_shutter_s * (row / camera_.height() - 0.5));
  }
  return poses;
}

// The object and what is before it, at the index-th pose of the path.
void SimulatedSequence::draw_object(int index, cv::Mat* color, cv::Mat* mask) const {
  const cv::Mat behind = options_.hand_held ? background(share_done(index)) : background_;
  Renderer::Picture picture =
      renderer_.render(*scene_at(index), poses_of_bands(index), lighting(index), behind);
  if (options_.occluder) {
    const auto texture_seed = static_cast<std::uint32_t>(derived_seed(options_.seed, 3));
    draw_hand(camera_, share_done(index), texture_seed, options_.threads, &picture.color, &picture.mask);
  }
  if (options_.bonnet != BonnetKind::kNone) {
    const auto texture_seed = static_cast<std::uint32_t>(derived_seed(options_.seed, 5));
    draw_bonnet(camera_, options_.bonnet == BonnetKind::kShakes, index, texture_seed, options_.threads,
                &picture.color, &picture.mask);
  }
  *color = picture.color;
  *mask = picture.mask;
}

double SimulatedSequence::share_done(int index) const {
  return path_.size() > 1 ? static_cast<double>(std::max(index, 0)) / (path_.size() - 1) : 0;
}

std::int64_t SimulatedSequence::stamp(int frame) const {
  const int index = frame - options_.lead_in;
  if (index >= 0) return path_.at(index).stamp_ns;
  return path_.front().stamp_ns - nanoseconds(-index / options_.rate_hz);
}

SimulatedFrame SimulatedSequence::render(int frame) const {
  const int index = frame - options_.lead_in;
  SimulatedFrame result;
  result.stamp_ns = stamp(frame);
  cv::Mat color = background_;
  if (index >= 0) {
    result.map_from_camera = path_.at(index).map_from_camera;
    draw_object(index, &color, &result.mask);
  } else {
    result.mask = cv::Mat::zeros(background_.size(), CV_8UC1);
  }
  SensorEffects effects;
  effects.blur_px = options_.blur_px;
  // One and a half periods over the sequence: brighter, darker, brighter again.
  effects.gain = 1 + options_.exposure_drift * std::sin(3 * kPi * share_done(index));
  effects.noise_grey_levels = options_.noise_grey_levels;
  effects.noise_seed = derived_seed(options_.seed, 1000 + static_cast<std::uint64_t>(frame));
  result.image = expose(color, effects, options_.threads);
  return result;
}

}  // namespace mono_pose_tracker
