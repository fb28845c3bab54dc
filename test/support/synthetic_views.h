#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/rotation.h"
#include "common/statistics.h"
#include "map/frame.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"
#include "mono_pose_tracker/robust/ransac_options.h"

namespace mono_pose_tracker {

/// A camera without distortion in round numbers, for projections by hand.
inline CameraModel plain_camera() {
  CameraParameters p;
  p.width = 640;
  p.height = 480;
  p.fx = p.fy = 500;
  p.cx = 320;
  p.cy = 240;
  return CameraModel(p);
}

inline CameraModel synthetic_camera() {
  CameraParameters parameters;
  parameters.width = 640;
  parameters.height = 480;
  parameters.fx = parameters.fy = 600;
  parameters.cx = 319.5;
  parameters.cy = 239.5;
  return CameraModel(parameters);
}

/// A threshold above noise of half a pixel.
inline RansacOptions ransac_of_two_px(const CameraModel& camera) {
  RansacOptions ransac;
  ransac.threshold = 2 / camera.focal();
  return ransac;
}

/// Points with one descriptor each. Two random descriptors are about as far apart as those of unrelated
/// patches (unit length is stored as 512).
struct SyntheticScene {
  std::vector<Eigen::Vector3d> x_in_map;
  cv::Mat descriptors;  // N x 128, CV_8U

  SyntheticScene(const std::vector<Eigen::Vector3d>& points, Random& random)
      : x_in_map(points), descriptors(static_cast<int>(points.size()), 128, CV_8U) {
    for (int i = 0; i < descriptors.rows; ++i) {
      for (int k = 0; k < 128; ++k)
        descriptors.at<std::uint8_t>(i, k) = static_cast<std::uint8_t>(random.index(80));
    }
  }
};

/// Points in front of a camera at the origin: x, y within 1.6 and 1.2, depths from 3 to 6.
inline SyntheticScene box_scene(int points, Random& random) {
  std::vector<Eigen::Vector3d> x_in_map;
  for (int i = 0; i < points; ++i) {
    x_in_map.emplace_back(random.uniform(-1.6, 1.6), random.uniform(-1.2, 1.2), random.uniform(3, 6));
  }
  return SyntheticScene(x_in_map, random);
}

/// Points of a plane that recedes to the right.
inline SyntheticScene plane_scene(int points, Random& random) {
  std::vector<Eigen::Vector3d> x_in_map;
  for (int i = 0; i < points; ++i) {
    const double x = random.uniform(-1.6, 1.6);
    x_in_map.emplace_back(x, random.uniform(-1.2, 1.2), 4 + 0.5 * x);
  }
  return SyntheticScene(x_in_map, random);
}

/// The features of the scene in the camera's image, with pixel noise; features[k] is of point point_of[k].
inline Frame synthetic_frame(const SyntheticScene& scene, const CameraModel& camera,
                             const Rigid3& camera_from_map, double noise_px, std::int64_t index,
                             Random& random, std::vector<int>* point_of = nullptr) {
  FeatureSet set;
  for (int i = 0; i < static_cast<int>(scene.x_in_map.size()); ++i) {
    Eigen::Vector2d pixel;
    if (!camera.project(camera_from_map * scene.x_in_map[i], &pixel)) continue;
    pixel += noise_px * Eigen::Vector2d(random.normal(), random.normal());
    if (!camera.in_image(pixel)) continue;
    Feature feature;
    feature.pixel = pixel.cast<float>();
    feature.scale = 2;
    feature.response = 1;
    set.features.push_back(feature);
    set.descriptors.push_back(scene.descriptors.row(i));
    if (point_of) point_of->push_back(i);
  }
  const cv::Mat image(camera.height(), camera.width(), CV_8UC1, cv::Scalar(128));
  return {index, index * 100000000, make_image_features(std::move(set), image, camera)};
}

/// A camera at `center_in_map` turned by `yaw` radians about its y axis.
inline Rigid3 camera_at(const Eigen::Vector3d& center_in_map, double yaw = 0) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()));
  return {turn, -(turn * center_in_map)};
}

/// The front of a head of half a unit around the origin, with the face along -z. A view from 6 units is
/// narrow.
inline SyntheticScene synthetic_head(int points, Random& random) {
  std::vector<Eigen::Vector3d> x_in_map;
  for (int i = 0; i < points; ++i) {
    const double azimuth = random.uniform(-1.3, 1.3), height = random.uniform(-0.6, 0.6);
    x_in_map.emplace_back(0.5 * std::sin(azimuth), height, -0.5 * std::cos(azimuth));
  }
  return SyntheticScene(x_in_map, random);
}

/// A view from 6 units, rotated about a slightly tilted axis.
inline Rigid3 before_turned_head(double angle_rad) {
  const Eigen::Vector3d axis = Eigen::Vector3d(0.2, 1, 0).normalized();
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis)), Eigen::Vector3d(0, 0, 6)};
}

/// Adds the k-th keyframe, a tenth of a second after the previous one. It observes each point as the landmark
/// of that number.
inline void add_view(const SyntheticScene& scene, const CameraModel& camera, const Rigid3& camera_from_map,
                     double noise_px, int k, const std::vector<LandmarkId>& landmarks, Random& random,
                     Map* map) {
  std::vector<int> point_of;
  const Frame frame = synthetic_frame(scene, camera, camera_from_map, noise_px, k, random, &point_of);
  const KeyframeId id = map->add_keyframe(k, k * std::int64_t{100'000'000}, camera_from_map, frame.image);
  for (std::size_t f = 0; f < point_of.size(); ++f) {
    map->add_observation(landmarks[point_of[f]], id, static_cast<int>(f));
  }
}

/// Points of a skyline at 3000 to 5000 units first, then points 2 to 5 units away.
inline std::vector<Eigen::Vector3d> skyline_points(int far, int near, Random& random) {
  std::vector<Eigen::Vector3d> x;
  for (int i = 0; i < far + near; ++i) {
    const double depth = i < far ? random.uniform(3000, 5000) : random.uniform(2, 5);
    x.emplace_back(depth * random.uniform(-0.4, 0.4), depth * random.uniform(-0.3, 0.3), depth);
  }
  return x;
}

/// A camera that moves past such points, by 0.05 units and half a degree between views.
struct SkylineWalk {
  static constexpr int kViews = 10, kFarPoints = 80, kNearPoints = 120;
  static constexpr double kStep = 0.05;

  Random random{5};
  CameraModel camera = synthetic_camera();
  SyntheticScene scene{skyline_points(kFarPoints, kNearPoints, random), random};
  MapperOptions options;
  Map map;

  SkylineWalk() { options.ransac = ransac_of_two_px(camera); }

  static Rigid3 pose(int view) { return camera_at({kStep * view, 0, 0}, -0.5 * view * kDegree); }
};

}  // namespace mono_pose_tracker
