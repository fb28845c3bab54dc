#include "simulation/endless_room.h"

#include <Eigen/Geometry>
#include <cmath>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "common/rotation.h"
#include "simulation/camera_path.h"
#include "simulation/simulated_sequence.h"

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

}  // namespace mono_pose_tracker
