#include "simulation/image_layers.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "common/rotation.h"
#include "common/threads.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "simulation/texture.h"

namespace mono_pose_tracker {
namespace {

constexpr double kWallDistance = 1.0;  // m

LeafStyle textured_style() {
  LeafStyle style;
  style.base = Color(0.45f, 0.48f, 0.50f);
  style.palette = {
      {0.25f, 0.30f, 0.36f}, {0.62f, 0.58f, 0.48f}, {0.48f, 0.30f, 0.26f}, {0.34f, 0.44f, 0.36f}};
  style.largest = 0.25f;
  style.smallest = 0.008f;
  style.opacity = 0.95f;
  return style;
}

/// Painted plaster, brightest towards the lamp at the upper left: shades too smooth for features, a grain of
/// a grey level or two, and a mark every few decimetres.
Color bright_wall(std::uint32_t seed, float x, float y, float footprint) {
  const float shade = 0.86f - 0.05f * x - 0.06f * y - 0.08f * (x * x + y * y);
  const float grain = 0.006f * fractal_noise(seed, x, y, 0.012f, 4, footprint);
  const float cell = 0.30f;
  const int i = floor_int(x / cell), j = floor_int(y / cell);
  const std::uint32_t h = hash_cell(seed + 1, i, j);
  const float u = x / cell - i - 0.2f - 0.6f * unit_float(h),
              v = y / cell - j - 0.2f - 0.6f * unit_float(rehash(h));
  const float mark = 0.10f * unit_float(rehash(h + 1)) * smooth_step(0.016f, 0.008f, std::hypot(u, v));
  return Color(0.97f, 0.98f, 1.0f) * (shade + grain - mark);
}

/// Colours of a wall at this distance behind the camera's image.
cv::Mat draw_wall(const CameraModel& camera, int threads,
                  const std::function<Color(float x, float y, float footprint)>& color_at) {
  cv::Mat image(camera.height(), camera.width(), CV_32FC3);
  parallel_for(camera.height(), threads, [&](int row) {
    for (int column = 0; column < camera.width(); ++column) {
      const Eigen::Vector3d ray = camera.bearing(Eigen::Vector2d(column, row));
      const double scale = kWallDistance / std::max(ray.z(), 0.1);
      const Color color = color_at(static_cast<float>(scale * ray.x()), static_cast<float>(scale * ray.y()),
                                   static_cast<float>(scale / camera.focal()));
      image.at<cv::Vec3f>(row, column) = cv::Vec3f(color.z(), color.y(), color.x());
    }
  });
  return image;
}

}  // namespace

cv::Mat static_background(const CameraModel& camera, BackgroundKind kind, std::uint32_t seed, int threads) {
  if (kind == BackgroundKind::kWall) {
    return draw_wall(camera, threads,
                     [&](float x, float y, float footprint) { return bright_wall(seed, x, y, footprint); });
  }
  if (kind == BackgroundKind::kTextured) {
    const LeafStyle style = textured_style();
    return draw_wall(camera, threads, [&](float x, float y, float footprint) {
      return Color(0.75f * leaf_texture(style, seed, x, y, footprint));
    });
  }
  return cv::Mat(camera.height(), camera.width(), CV_32FC3, cv::Scalar(0.085, 0.075, 0.07));
}

namespace {

using Eigen::Vector2f;

constexpr float kBonnetTop = 0.74f;  // share of the image's height, in the middle
constexpr float kArch = 0.15f;       // lower by so much at the sides
constexpr float kShake = 2;          // px at 640 px width

LeafStyle bonnet_style() {
  return leaf_style(Color(0.20f, 0.22f, 0.26f),
                    {{0.05f, 0.06f, 0.08f}, {0.55f, 0.57f, 0.60f}, {0.30f, 0.10f, 0.08f}}, 0.25f, 0.04f,
                    0.6f);
}

// px. Of frames of their own periods, so that no two places are the same for long.
Vector2f shaken(bool shakes, int frame, float scale) {
  if (!shakes) return Vector2f::Zero();
  const auto time = static_cast<float>(frame);
  return kShake * scale * Vector2f(std::sin(0.31f * time), 0.5f * std::sin(0.83f * time));
}

}  // namespace

void draw_bonnet(const CameraModel& camera, bool shakes, int frame, std::uint32_t seed, int threads,
                 cv::Mat* color, cv::Mat* mask) {
  const LeafStyle style = bonnet_style();
  const auto width = static_cast<float>(camera.width()), height = static_cast<float>(camera.height());
  const Vector2f shift = shaken(shakes, frame, static_cast<float>(image_scale(camera)));
  parallel_for(camera.height(), threads, [&](int row) {
    for (int column = 0; column < camera.width(); ++column) {
      const Vector2f place = (Vector2f(static_cast<float>(column), static_cast<float>(row)) - shift) / width;
      const float off_middle = 2 * place.x() - 1;
      if (place.y() * width < (kBonnetTop + kArch * off_middle * off_middle) * height) continue;
      const Color c = leaf_texture(style, seed, place.x(), place.y(), 1 / width);
      color->at<cv::Vec3f>(row, column) = cv::Vec3f(c.z(), c.y(), c.x());
      mask->at<std::uint8_t>(row, column) = 0;
    }
  });
}

namespace {

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
