#include "simulation/simulated_sequence.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <stdexcept>
#include <string>

#include "common/rotation.h"
#include "common/statistics.h"
#include "common/threads.h"
#include "common/time_stamp.h"
#include "io/image_coding.h"
#include "simulation/camera_path.h"
#include "simulation/head_scene.h"
#include "simulation/head_stage.h"
#include "simulation/image_layers.h"
#include "simulation/panel_scene.h"
#include "street_scene.h"

namespace mono_pose_tracker {
namespace {

void require(bool holds, const char* key, double value, const char* expected) {
  if (holds) return;
  std::ostringstream text;
  text.precision(15);
  text << key << " = " << value << ", expected " << expected;
  throw std::invalid_argument(text.str());
}

}  // namespace

void SequenceOptions::validate() const {
  require(frames >= 0 && frames <= kMaxFrames, "frames", frames, "0 (all) to 1000000");
  require(lead_in >= 0 && lead_in <= kMaxFrames, "lead_in", lead_in, "0 to 1000000");
  require_image_size();
  require(lead_in == 0 || has_head(scene), "lead_in", lead_in, "0: only scenes with a head have a lead-in");
  require(shine >= 0 && shine <= 1, "shine", shine, "0 to 1");
  require_what_has_it();
  require(noise_grey_levels >= 0, "noise_grey_levels", noise_grey_levels, "0 or more");
  require(blur_px >= 0 && blur_px <= 50, "blur_px", blur_px, "0 to 50");
  require(exposure_drift >= 0 && exposure_drift < 1, "exposure_drift", exposure_drift,
          "0 or more and less than 1");
  require(rate_hz >= kMinRateHz && rate_hz <= kMaxRateHz, "rate_hz", rate_hz, "0.001 to 1000000");
  require(rolling_shutter_s >= 0 && rolling_shutter_s * rate_hz <= 1, "rolling_shutter_s", rolling_shutter_s,
          "0 to 1 / rate_hz: the next image begins after it");
  require(rolling_shutter_s == 0 || !hand_held, "rolling_shutter_s", rolling_shutter_s,
          "0 with hand_held: the background has a global shutter");
  require(first_stamp_s >= 0 && first_stamp_s <= kMaxStampS, "first_stamp_s", first_stamp_s,
          "0 to 4294967295: the range of a message's stamp");
  require(samples >= 1 && samples <= 8, "samples", samples, "1 to 8");
  require(threads >= 0, "threads", threads, "0 (all) or more");
}

// Before anything is made of that size.
void SequenceOptions::require_image_size() const {
  if (camera.width <= 0 || camera.height <= 0) return;  // the camera model refuses them
  const double pixels = static_cast<double>(camera.width) * camera.height;
  require(pixels <= static_cast<double>(kMaxImagePixels), "width * height", pixels,
          "100000000 pixels at most");
}

// Options that only some scenes know.
void SequenceOptions::require_what_has_it() const {
  const bool living = shoulders != ShouldersKind::kNone || face.speaks || face.blinks || face.loose_hair;
  require(!living || scene == SceneKind::kHead, "shoulders, speaks, blinks, loose_hair", living,
          "0: only the head has them");
  require(shine == 0 || has_head(scene), "shine", shine, "0: only scenes with a head have reflections");
  require(background == BackgroundKind::kPlain || has_head(scene), "background", static_cast<int>(background),
          "0 (plain): only scenes with a head have a background");
  require(!hand_held || has_head(scene), "hand_held", hand_held, "0: only for scenes with a head");
  const bool still = background == BackgroundKind::kTextured || background == BackgroundKind::kWall;
  require(!hand_held || !still, "hand_held", hand_held, "0, or a background that is plain or a room");
  require(!hand_held || lead_in == 0, "hand_held", hand_held, "0 with a lead-in");
}

CameraParameters default_camera(SceneKind scene, int width, int height) {
  CameraParameters camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = (has_head(scene) ? 1.2 : 0.82) * width;  // 45 and 63 degrees wide
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  camera.distortion = {0, 0, 0, 0, 0};
  return camera;
}

namespace {

/// What the camera does to the light of one frame, in this order.
struct SensorEffects {
  double blur_px = 0;  // standard deviation of a Gaussian
  double gain = 1;     // of the exposure
  double noise_grey_levels =
      0;  // standard deviation, of 255; the same in the three colours, so in the grey image too
  std::uint64_t noise_seed = 0;
};

/// From light (CV_32FC3, [0, 1]) to the image (CV_8UC3).
cv::Mat expose(const cv::Mat& light, const SensorEffects& effects, int threads);

cv::Mat expose(const cv::Mat& light, const SensorEffects& effects, int threads) {
  cv::Mat blurred = light;
  if (effects.blur_px > 0) {
    cv::GaussianBlur(light, blurred, cv::Size(), effects.blur_px, effects.blur_px, cv::BORDER_REPLICATE);
  }
  cv::Mat image(light.size(), CV_8UC3);
  parallel_for(light.rows, threads, [&](int row) {
    // A generator a row: the noise does not depend on which thread comes first.
    Random random(effects.noise_seed ^ (static_cast<std::uint64_t>(row + 1) * 0xd1342543de82ef95ull));
    for (int column = 0; column < light.cols; ++column) {
      const double noise = effects.noise_grey_levels > 0 ? effects.noise_grey_levels * random.normal() : 0;
      const cv::Vec3f& in = blurred.at<cv::Vec3f>(row, column);
      cv::Vec3b& out = image.at<cv::Vec3b>(row, column);
      for (int c = 0; c < 3; ++c)
        out[c] = cv::saturate_cast<std::uint8_t>(255 * effects.gain * in[c] + noise);
    }
  });
  return image;
}

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
