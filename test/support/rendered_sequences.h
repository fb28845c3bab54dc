#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "simulation/simulated_sequence.h"

namespace mono_pose_tracker {

inline SequenceOptions small_options(SceneKind scene, int width = 200, int height = 150) {
  SequenceOptions options;
  options.scene = scene;
  options.camera = default_camera(scene, width, height);
  options.threads = 2;
  return options;
}

/// The point of the object at a pixel; false where there is none.
inline bool point_seen(const SimulatedSequence& sequence, int frame, const Eigen::Vector2d& pixel,
                       Eigen::Vector3d* x_in_map) {
  const Rigid3& map_from_camera = sequence.path()[frame].map_from_camera;
  const Ray ray{map_from_camera.translation, map_from_camera.rotation * sequence.camera().bearing(pixel)};
  Hit hit;
  const std::shared_ptr<const Scene> scene = sequence.scene_at(frame);
  if (!scene->intersect(ray, 0, &hit) || !scene->is_object(hit)) return false;
  *x_in_map = ray.origin + hit.distance * ray.direction;
  return true;
}

/// Whether the surface around a pixel is smooth: near depth edges the blurred image mixes surfaces that move
/// differently.
inline bool smooth_surface(const SimulatedSequence& sequence, int frame, const Eigen::Vector2d& pixel) {
  const Eigen::Vector3d camera = sequence.path()[frame].map_from_camera.translation;
  const auto distance = [&](double dx, double dy) {
    Eigen::Vector3d point;
    return point_seen(sequence, frame, pixel + Eigen::Vector2d(dx, dy), &point) ? (point - camera).norm()
                                                                                : 1e9;
  };
  const double here = distance(0, 0), reach = 4;  // px: four deviations of the blur
  return std::fabs(distance(reach, 0) + distance(-reach, 0) - 2 * here) < 0.01 * here &&
         std::fabs(distance(0, reach) + distance(0, -reach) - 2 * here) < 0.01 * here;
}

inline double grey(const cv::Mat& image, const Eigen::Vector2d& pixel) {
  cv::Mat patch;
  cv::getRectSubPix(image, {1, 1}, cv::Point2f(static_cast<float>(pixel.x()), static_cast<float>(pixel.y())),
                    patch);
  return patch.at<float>(0, 0);
}

inline cv::Mat smooth_grey(const cv::Mat& image) {
  cv::Mat result;
  cv::cvtColor(image, result, cv::COLOR_BGR2GRAY);
  result.convertTo(result, CV_32F);
  cv::GaussianBlur(result, result, {}, 1.0);
  return result;
}

/// Displacement (px) of frame b from the image that ground truth, scene and frame a predict: the shift over
/// the whole image that best explains the grey level differences (Lucas and Kanade).
inline Eigen::Vector2d misplacement(const SimulatedSequence& sequence, int a, int b) {
  const cv::Mat image_a = smooth_grey(sequence.render(a).image),
                image_b = smooth_grey(sequence.render(b).image);
  const Rigid3 b_from_map = sequence.path()[b].map_from_camera.inverse();
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  int compared = 0;
  for (int y = 4; y < image_a.rows - 4; y += 2) {
    for (int x = 4; x < image_a.cols - 4; x += 2) {
      Eigen::Vector3d point, back;
      Eigen::Vector2d p;
      if (!point_seen(sequence, a, Eigen::Vector2d(x, y), &point)) continue;
      if (!sequence.camera().project(b_from_map * point, &p) || !sequence.camera().in_image(p, 3)) continue;
      if (!point_seen(sequence, b, p, &back) || (back - point).norm() > 1e-4) continue;  // hidden in b
      const Eigen::Vector2d gradient(
          0.5 * (grey(image_b, p + Eigen::Vector2d(1, 0)) - grey(image_b, p - Eigen::Vector2d(1, 0))),
          0.5 * (grey(image_b, p + Eigen::Vector2d(0, 1)) - grey(image_b, p - Eigen::Vector2d(0, 1))));
      if (!smooth_surface(sequence, a, Eigen::Vector2d(x, y)) || !smooth_surface(sequence, b, p)) continue;
      const double difference = image_a.at<float>(y, x) - grey(image_b, p);
      normal += gradient * gradient.transpose();
      right += gradient * difference;
      ++compared;
    }
  }
  // Without pixels or texture the shift would be zero.
  EXPECT_GT(compared, 500);
  EXPECT_GT(normal.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), 500);
  return normal.ldlt().solve(right);
}

}  // namespace mono_pose_tracker
