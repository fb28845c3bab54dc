#include "simulation/static_background.h"

#include <algorithm>
#include <functional>

#include "common/threads.h"
#include "simulation/leaf_texture.h"
#include "simulation/noise.h"

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

}  // namespace mono_pose_tracker
