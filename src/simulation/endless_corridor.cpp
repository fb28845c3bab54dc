#include "simulation/endless_corridor.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "common/random.h"
#include "common/rotation.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "simulation/noise.h"

namespace mono_pose_tracker {
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
