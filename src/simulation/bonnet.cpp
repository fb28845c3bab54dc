#include "simulation/bonnet.h"

#include <cmath>

#include "common/threads.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "simulation/leaf_texture.h"

namespace mono_pose_tracker {
namespace {

using Eigen::Vector2f;

constexpr float kTop = 0.74f;   // share of the image's height, in the middle
constexpr float kArch = 0.15f;  // lower by so much at the sides
constexpr float kShake = 2;     // px at 640 px width

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
      if (place.y() * width < (kTop + kArch * off_middle * off_middle) * height) continue;
      const Color c = leaf_texture(style, seed, place.x(), place.y(), 1 / width);
      color->at<cv::Vec3f>(row, column) = cv::Vec3f(c.z(), c.y(), c.x());
      mask->at<std::uint8_t>(row, column) = 0;
    }
  });
}

}  // namespace mono_pose_tracker
