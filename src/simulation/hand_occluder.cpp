#include "simulation/hand_occluder.h"

#include <algorithm>
#include <cmath>

#include "common/rotation.h"
#include "common/threads.h"
#include "simulation/noise.h"

namespace mono_pose_tracker {
namespace {

using Eigen::Vector2f;

constexpr float kHandDistance = 0.35f;  // m before the camera
constexpr double kComes = 0.25, kGone = 0.75;

float capsule(const Vector2f& p, const Vector2f& a, const Vector2f& b, float radius) {
  const Vector2f axis = b - a;
  const float s = std::clamp((p - a).dot(axis) / axis.squaredNorm(), 0.f, 1.f);
  return (p - a - s * axis).norm() - radius;
}

/// Signed distance (m) from a flat hand that points along -y, its wrist going on along +y.
float hand_distance(const Vector2f& p) {
  float d = capsule(p, {0, -0.005f}, {0, 0.03f}, 0.042f);
  d = std::min(d, capsule(p, {0.004f, 0.05f}, {0.01f, 0.4f}, 0.031f));
  d = std::min(d, capsule(p, {-0.033f, -0.03f}, {-0.042f, -0.095f}, 0.0085f));
  d = std::min(d, capsule(p, {-0.012f, -0.04f}, {-0.014f, -0.117f}, 0.0092f));
  d = std::min(d, capsule(p, {0.010f, -0.04f}, {0.013f, -0.110f}, 0.0090f));
  d = std::min(d, capsule(p, {0.032f, -0.03f}, {0.041f, -0.085f}, 0.0080f));
  return std::min(d, capsule(p, {-0.030f, 0.02f}, {-0.080f, -0.035f}, 0.0105f));
}

cv::Vec3f hand_color(std::uint32_t seed, const Vector2f& p, float distance, float footprint) {
  const float rounded = 0.55f + 0.45f * smooth_step(0.f, -0.012f, distance);  // darker towards its edges
  // Strong enough for features of its own, which move otherwise than the object's.
  const float texture = 1.f + 0.10f * fractal_noise(seed, p.x(), p.y(), 0.02f, 3, footprint) +
                        0.22f * fractal_noise(seed + 50, p.x(), p.y(), 0.004f, 3, footprint);
  return cv::Vec3f(0.44f, 0.54f, 0.72f) * (rounded * texture);
}

/// Where the hand is: p_in_hand = rotation * (p_in_plane - position), m.
struct HandPose {
  Vector2f position;
  float cosine, sine;
};

HandPose hand_pose(double done) {
  const double s = std::clamp((done - kComes) / (kGone - kComes), 0.0, 1.0);
  const auto in = static_cast<float>(std::sin(kPi * s));  // 0 outside the image, 1 farthest in
  const float angle = -0.6f + 0.5f * static_cast<float>(std::sin(3 * kPi * s));
  return {{0.22f - 0.20f * in, 0.30f - 0.28f * in}, std::cos(angle), std::sin(angle)};
}

}  // namespace

void draw_hand(const CameraModel& camera, double done, std::uint32_t seed, int threads, cv::Mat* color,
               cv::Mat* mask) {
  if (done <= kComes || done >= kGone) return;
  const HandPose pose = hand_pose(done);
  const auto pixel_size = static_cast<float>(kHandDistance / camera.focal());
  parallel_for(camera.height(), threads, [&](int row) {
    for (int column = 0; column < camera.width(); ++column) {
      const Eigen::Vector3d ray = camera.bearing(Eigen::Vector2d(column, row));
      if (ray.z() < 0.1) continue;
      const Vector2f q = kHandDistance * (ray.head<2>() / ray.z()).cast<float>() - pose.position;
      const Vector2f p(pose.cosine * q.x() + pose.sine * q.y(), pose.cosine * q.y() - pose.sine * q.x());
      const float distance = hand_distance(p);
      const float coverage = std::clamp(0.5f - distance / pixel_size, 0.f, 1.f);
      if (coverage <= 0) continue;
      cv::Vec3f& pixel = color->at<cv::Vec3f>(row, column);
      pixel += coverage * (hand_color(seed, p, distance, pixel_size) - pixel);
      if (distance < 0) mask->at<std::uint8_t>(row, column) = 0;
    }
  });
}

}  // namespace mono_pose_tracker
