#include "simulation/endless_room.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "common/rotation.h"
#include "common/statistics.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "simulation/camera_path.h"
#include "simulation/simulated_sequence.h"
#include "simulation/texture.h"

namespace mono_pose_tracker {
namespace {

// The hand: slow turns, and a tremor of some hertz.
constexpr double kTurnDegrees = 2.5;
constexpr double kShakeDegrees = 0.15;

// Seconds by which the camera may be before or behind a steady walk: its speed then changes by up to a half.
constexpr double kSpeedSeconds = 1;

// Longer than what a frame takes of it, so that few rows of one frame share their noise.
constexpr int kNoiseLength = 1 << 22;

/// Of the images that are turned: the corners must stay inside under the largest turn about the three axes.
int margin_px(const CameraParameters& camera) {
  const double angle = std::sqrt(3.0) * (kTurnDegrees + kShakeDegrees) * kDegree;
  const double corner = std::hypot(camera.cx, camera.cy) / std::min(camera.fx, camera.fy);
  return 2 + static_cast<int>(std::ceil(angle * camera.fx * (1 + corner * corner)));
}

CameraParameters with_margin(CameraParameters camera) {
  const int margin = margin_px(camera);
  camera.width += 2 * margin;
  camera.height += 2 * margin;
  camera.cx += margin;
  camera.cy += margin;
  return camera;
}

Eigen::Matrix3d matrix_of(const CameraParameters& camera) {
  Eigen::Matrix3d matrix;
  matrix << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1;
  return matrix;
}

void validate(const EndlessRoomOptions& options) {
  const CameraModel camera(options.camera);  // throws on parameters of no camera
  for (const double d : options.camera.distortion) {
    if (d != 0) throw std::invalid_argument("distortion = " + std::to_string(d) + ", expected none");
  }
  if (!(options.rate_hz > 0)) throw std::invalid_argument("rate_hz: expected more than 0");
  if (options.lap_frames < 3) throw std::invalid_argument("lap_frames: expected 3 or more");
  if (!(options.noise_grey_levels >= 0 && options.noise_grey_levels <= 30)) {
    throw std::invalid_argument("noise_grey_levels: expected 0 to 30");
  }
}

cv::Mat make_noise(double deviation, std::uint64_t seed) {
  cv::Mat noise(1, kNoiseLength, CV_8SC1);
  Random random(seed);
  for (int i = 0; i < kNoiseLength; ++i) {
    noise.at<schar>(i) = cv::saturate_cast<schar>(deviation * random.normal());
  }
  return noise;
}

}  // namespace

EndlessRoom::Hand::Hand(Random random)
    : speed(0.03, 0.15, &random), turn(0.02, 0.12, &random), shake(2, 6, &random) {}

EndlessRoom::EndlessRoom(const EndlessRoomOptions& options, const std::function<void()>& progress)
    : options_((validate(options), options)),
      wide_camera_(with_margin(options.camera)),
      hand_(Random(options.seed)),
      noise_(make_noise(options.noise_grey_levels, options.seed + 1)) {
  SequenceOptions lap;
  lap.scene = SceneKind::kRoom;
  lap.camera = wide_camera_;
  lap.seed = options.seed;
  lap.threads = options.threads;
  lap.samples = 1;  // edges are not smoothed: twice as fast, and noise hides the rest
  for (const Rigid3& pose : room_lap(options.lap_frames)) lap.path.push_back({0, pose});
  lap_ = lap.path;
  const SimulatedSequence sequence(lap);
  for (int i = 0; i < sequence.size(); ++i) {
    cv::cvtColor(sequence.render(i).image, views_.emplace_back(), cv::COLOR_BGR2GRAY);
    if (progress) progress();
  }
}

EndlessRoom::Frame EndlessRoom::frame(std::int64_t index) const {
  const double seconds = static_cast<double>(index) / options_.rate_hz;
  const double walked = options_.rate_hz * (seconds + kSpeedSeconds * hand_.speed(seconds));
  const auto laps = static_cast<std::int64_t>(lap_.size());
  const std::int64_t position = ((std::llround(walked) % laps) + laps) % laps;

  const Eigen::Vector3d turned =
      kDegree * (kTurnDegrees * hand_.turn(seconds) + kShakeDegrees * hand_.shake(seconds));
  const Rigid3 view_from_camera(Eigen::Quaterniond(Eigen::AngleAxisd(turned.norm(), turned.normalized())),
                                Eigen::Vector3d::Zero());
  Frame frame;
  frame.truth = {std::llround(1e9 * (1 + seconds)), lap_[position].map_from_camera * view_from_camera};
  const Eigen::Matrix3d view_pixel_from_pixel =
      matrix_of(wide_camera_) * view_from_camera.rotation_matrix() * matrix_of(options_.camera).inverse();
  cv::Mat homography;
  cv::eigen2cv(view_pixel_from_pixel, homography);
  cv::warpPerspective(views_[position], frame.image, homography,
                      cv::Size(options_.camera.width, options_.camera.height),
                      cv::INTER_CUBIC | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  add_noise(index, &frame.image);
  return frame;
}

void EndlessRoom::add_noise(std::int64_t index, cv::Mat* image) const {
  Random random(options_.seed + 2 + static_cast<std::uint64_t>(index) * 0xd1342543de82ef95ull);
  for (int row = 0; row < image->rows; ++row) {
    const int from = static_cast<int>(random.index(kNoiseLength - image->cols));
    cv::Mat pixels = image->row(row);
    cv::add(pixels, noise_.colRange(from, from + image->cols), pixels, cv::noArray(), CV_8U);
  }
}

namespace {

// The map's axes: x along the corridor, y to the right, z down. Metres, and metres a second.
constexpr double kHalfWidth = 1.2, kHalfHeight = 1.3;
constexpr double kSpeed = 0.25;
constexpr double kAskance = 60;  // degrees from the way ahead to the right
// Where the walls are lost in the dark: beyond, their pattern would be finer than pixels.
constexpr double kLightRange = 8;
// The pattern is of pieces, each with a seed of its own: far along, a float would not tell a pattern's
// places.
constexpr double kPiece = 32;

// A wall's pattern at (along, across): blobs of all sizes from half a metre to four centimetres.
float pattern(std::uint32_t seed, double along, double across) {
  const double piece = std::floor(along / kPiece);
  const std::uint32_t own = hash_cell(seed, static_cast<int>(piece), 7);
  const auto u = static_cast<float>(along - piece * kPiece), v = static_cast<float>(across + 8);
  float value = 128;
  for (const auto& [frequency, amplitude] : {std::pair<float, float>{2, 50}, {5, 45}, {11, 40}, {25, 30}}) {
    value +=
        amplitude * value_noise(own + static_cast<std::uint32_t>(frequency), frequency * u, frequency * v);
  }
  return value;
}

}  // namespace

EndlessCorridor::EndlessCorridor(const EndlessRoomOptions& options)
    : options_(options),
      sway_([&] {
        Random random(options.seed);
        return Wander3(0.05, 0.4, &random);
      }()),
      turn_([&] {
        Random random(options.seed + 1);
        return Wander3(0.03, 0.3, &random);
      }()) {
  const CameraModel camera(options.camera);  // throws on parameters of no camera
  if (!(options.rate_hz > 0)) throw std::invalid_argument("rate_hz: expected more than 0");
}

Rigid3 EndlessCorridor::map_from_camera(double seconds) const {
  const Eigen::Vector3d sway = sway_(seconds), turn = 4 * kDegree * turn_(seconds);
  Eigen::Matrix3d map_from_level;  // camera axes: x right, y down, z ahead
  map_from_level << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(kAskance * kDegree, Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(turn.x(), Eigen::Vector3d::UnitX()) *
                                    Eigen::AngleAxisd(turn.y(), Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(turn.z(), Eigen::Vector3d::UnitZ()) * map_from_level);
  return {rotation, Eigen::Vector3d(kSpeed * seconds, -0.4 + 0.1 * sway.y(), 0.1 * sway.z())};
}

float EndlessCorridor::grey(const Eigen::Vector3d& from, const Eigen::Vector3d& along) const {
  const double half[] = {0, kHalfWidth, kHalfHeight};
  double nearest = std::numeric_limits<double>::infinity();
  int axis = 1;
  for (const int a : {1, 2}) {
    if (along[a] == 0) continue;
    const double distance = (std::copysign(half[a], along[a]) - from[a]) / along[a];
    if (distance < nearest) nearest = distance, axis = a;
  }
  if (nearest >= kLightRange) return 20;
  const Eigen::Vector3d x = from + nearest * along;
  const std::uint32_t wall = hash_cell(static_cast<std::uint32_t>(options_.seed), axis, along[axis] > 0);
  const auto light = static_cast<float>(1 - nearest / kLightRange);
  return 20 + light * (pattern(wall, x.x(), x[3 - axis]) - 20);
}

EndlessRoom::Frame EndlessCorridor::frame(std::int64_t index) const {
  const double seconds = static_cast<double>(index) / options_.rate_hz;
  EndlessRoom::Frame frame;
  frame.truth = {std::llround(1e9 * (1 + seconds)), map_from_camera(seconds)};
  const CameraModel camera(options_.camera);
  const Eigen::Matrix3d rotation = frame.truth.map_from_camera.rotation_matrix();
  cv::Mat image(options_.camera.height, options_.camera.width, CV_32F);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      image.at<float>(y, x) =
          grey(frame.truth.map_from_camera.translation, rotation * camera.bearing(Eigen::Vector2d(x, y)));
    }
  }
  cv::GaussianBlur(image, image, cv::Size(), 0.6);  // as a lens would
  cv::Mat noise(image.size(), CV_32F);
  cv::RNG(options_.seed * 0x9e3779b97f4a7c15ull + static_cast<std::uint64_t>(index))
      .fill(noise, cv::RNG::NORMAL, 0.0, std::max(options_.noise_grey_levels, 1e-6));
  cv::Mat(image + noise).convertTo(frame.image, CV_8U);
  return frame;
}

}  // namespace mono_pose_tracker
