#include "mono_pose_tracker/simulation/simulated_sequence.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <thread>

#include "mono_pose_tracker/common/random.h"
#include "mono_pose_tracker/simulation/camera_path.h"
#include "mono_pose_tracker/simulation/hand_occluder.h"
#include "mono_pose_tracker/simulation/head_scene.h"
#include "mono_pose_tracker/simulation/leaf_texture.h"
#include "mono_pose_tracker/simulation/panel_scene.h"
#include "mono_pose_tracker/simulation/parallel.h"
#include "mono_pose_tracker/simulation/sensor.h"
#include "street_scene.h"

namespace mono_pose_tracker {
namespace {

/// From the camera to the middle of the head, m: the head fills three quarters of the image's height.
constexpr double kHeadDistance = 0.55;

constexpr int kFrames = 120;  // of the paper's sequence
constexpr double kPi = 3.14159265358979323846;

void require(bool holds, const char* key, double value, const char* expected) {
  if (holds) return;
  throw std::invalid_argument(std::string(key) + " = " + std::to_string(value) + ", expected " + expected);
}

/// A stream of its own for each use of the sequence's seed.
std::uint64_t derived_seed(std::uint64_t seed, std::uint64_t use) {
  return Random(seed * 0x2545f4914f6cdd1dull + use).next();
}

int thread_count(int asked) {
  return asked > 0 ? asked : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

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

// frames 0: as many as suit the scene.
std::vector<Rigid3> scene_path(SceneKind kind, int frames, std::uint64_t seed) {
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
      return head_path(some, kHeadDistance, seed);
  }
}

std::int64_t nanoseconds(double seconds) { return std::llround(1e9 * seconds); }

/// A dark cloth, or a wall of strong texture a few decimetres behind the head.
cv::Mat make_background(const CameraModel& camera, BackgroundKind kind, std::uint64_t seed, int threads) {
  cv::Mat background(camera.height(), camera.width(), CV_32FC3, cv::Scalar(0.085, 0.075, 0.07));
  if (kind == BackgroundKind::kPlain) return background;
  LeafStyle style;
  style.base = Color(0.45f, 0.48f, 0.50f);
  style.palette = {
      {0.25f, 0.30f, 0.36f}, {0.62f, 0.58f, 0.48f}, {0.48f, 0.30f, 0.26f}, {0.34f, 0.44f, 0.36f}};
  style.largest = 0.25f;
  style.smallest = 0.008f;
  style.opacity = 0.95f;
  const auto texture_seed = static_cast<std::uint32_t>(derived_seed(seed, 1));
  constexpr double kWallDistance = 1.0;  // m
  parallel_for(camera.height(), threads, [&](int row) {
    for (int column = 0; column < camera.width(); ++column) {
      const Eigen::Vector3d ray = camera.bearing(Eigen::Vector2d(column, row));
      const double scale = kWallDistance / std::max(ray.z(), 0.1);
      const Color color =
          leaf_texture(style, texture_seed, static_cast<float>(scale * ray.x()),
                       static_cast<float>(scale * ray.y()), static_cast<float>(scale / camera.focal()));
      background.at<cv::Vec3f>(row, column) = cv::Vec3f(color.z(), color.y(), color.x()) * 0.75f;
    }
  });
  return background;
}

}  // namespace

void SequenceOptions::validate() const {
  require(frames >= 0, "frames", frames, "0 (all) or more");
  require(lead_in >= 0, "lead_in", lead_in, "0 or more");
  require(lead_in == 0 || scene == SceneKind::kHead, "lead_in", lead_in, "0: only the head can be away");
  require(noise_grey_levels >= 0, "noise_grey_levels", noise_grey_levels, "0 or more");
  require(blur_px >= 0 && blur_px <= 50, "blur_px", blur_px, "0 to 50");
  require(exposure_drift >= 0 && exposure_drift < 1, "exposure_drift", exposure_drift,
          "0 or more and less than 1");
  require(rate_hz > 0, "rate_hz", rate_hz, "more than 0");
  require(first_stamp_s >= 0, "first_stamp_s", first_stamp_s, "0 or more");
  require(samples >= 1 && samples <= 8, "samples", samples, "1 to 8");
  require(threads >= 0, "threads", threads, "0 (all) or more");
}

CameraParameters default_camera(SceneKind scene, int width, int height) {
  CameraParameters camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = (scene == SceneKind::kHead ? 1.2 : 0.82) * width;  // 45 and 63 degrees wide
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  camera.distortion = {0, 0, 0, 0, 0};
  return camera;
}

SimulatedSequence::SimulatedSequence(const SequenceOptions& options)
    : options_((options.validate(), options)),
      camera_(options.camera),
      scene_(make_scene(options.scene, options.seed)),
      renderer_(camera_, options.samples, thread_count(options.threads)) {
  options_.threads = thread_count(options.threads);
  background_ = make_background(camera_, options_.background, options_.seed, options_.threads);
  make_path();
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
  for (const Rigid3& pose : scene_path(options_.scene, options_.frames, derived_seed(options_.seed, 2))) {
    path_.push_back(
        {nanoseconds(options_.first_stamp_s + (options_.lead_in + index++) / options_.rate_hz), pose});
  }
}

Lighting SimulatedSequence::lighting(int index) const {
  if (options_.scene != SceneKind::kHead)
    return {Eigen::Vector3f(-0.4f, -0.5f, 0.75f).normalized(), -Eigen::Vector3f::UnitY()};
  // A lamp to the upper left of the camera, a window to its right.
  const Eigen::Vector3f key = Eigen::Vector3f(-0.5f, -0.75f, -0.8f).normalized();
  const Eigen::Vector3f fill = Eigen::Vector3f(0.4f, -0.3f, -0.8f).normalized();
  if (!options_.lights_move_with_camera) return {key, fill};
  const Eigen::Matrix3f rotation = path_.at(index).map_from_camera.rotation_matrix().cast<float>();
  return {rotation * key, rotation * fill};
}

// The object and what is before it, at the index-th pose of the path.
void SimulatedSequence::draw_object(int index, cv::Mat* color, cv::Mat* mask) const {
  Renderer::Picture picture =
      renderer_.render(*scene_, path_.at(index).map_from_camera, lighting(index), background_);
  if (options_.occluder) {
    const auto texture_seed = static_cast<std::uint32_t>(derived_seed(options_.seed, 3));
    draw_hand(camera_, share_done(index), texture_seed, options_.threads, &picture.color, &picture.mask);
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
