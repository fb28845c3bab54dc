#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "common/rotation.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/robust/ransac_options.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {

inline SyntheticScene box(int points, const Eigen::Vector3d& middle, const Eigen::Vector3d& half,
                          Random& random) {
  std::vector<Eigen::Vector3d> x;
  for (int i = 0; i < points; ++i) {
    x.push_back(middle + Eigen::Vector3d(half.x() * random.uniform(-1, 1), half.y() * random.uniform(-1, 1),
                                         half.z() * random.uniform(-1, 1)));
  }
  return SyntheticScene(x, random);
}

/// A head that rotates by 6 degrees between keyframes, in front of a room, viewed by a swaying hand-held
/// camera. The map has only poses; of its landmarks only the centroid is used.
class TwoObjects {
 public:
  static constexpr int kKeyframes = 8;

  static Rigid3 camera_from_head(int k) {
    return {Eigen::Quaterniond(Eigen::AngleAxisd(6 * k * kDegree, Eigen::Vector3d::UnitY())),
            Eigen::Vector3d(0.05 * std::sin(k), 0, 3)};
  }
  static Rigid3 camera_from_room(int k) {
    return {Eigen::Quaterniond(Eigen::AngleAxisd(1.5 * std::sin(2 * k) * kDegree, Eigen::Vector3d::UnitX())),
            Eigen::Vector3d(0.15 * std::sin(1.3 * k), 0.15 * std::cos(1.7 * k), 0)};
  }

  Map map_with(bool is_of_head, int head_points, int room_points,
               const Eigen::Vector3d& middle_of_room = {0, 0, 8}) {
    head_features_.clear();
    const SyntheticScene head = box(head_points, {0, 0, 0}, {0.5, 0.6, 0.5}, random_);
    const SyntheticScene room = box(room_points, middle_of_room, {4, 3, 2}, random_);
    Map map;
    for (int k = 0; k < kKeyframes; ++k) {
      FeatureSet both = synthetic_frame(head, camera_, camera_from_head(k), 0.3, k, random_).image->set;
      head_features_.push_back(both.size());
      if (room_points > 0) {
        const FeatureSet other =
            synthetic_frame(room, camera_, camera_from_room(k), 0.3, k, random_).image->set;
        both.features.insert(both.features.end(), other.features.begin(), other.features.end());
        cv::vconcat(both.descriptors.clone(), other.descriptors, both.descriptors);
      }
      both.bearings.clear();
      map.add_keyframe(
          k, k, is_of_head ? camera_from_head(k) : camera_from_room(k),
          make_image_features(std::move(both), cv::Mat(480, 640, CV_8UC1, cv::Scalar(128)), camera_));
    }
    for (const Eigen::Vector3d& x : (is_of_head ? head : room).x_in_map) map.add_landmark(x);
    return map;
  }

  const CameraModel& camera() const { return camera_; }
  RansacOptions ransac() const { return ransac_of_two_px(camera_); }
  /// Number of features of the head in a keyframe; they come first.
  int head_features(int k) const { return head_features_[k]; }

 private:
  Random random_{5};
  CameraModel camera_ = synthetic_camera();
  std::vector<int> head_features_;
};

}  // namespace mono_pose_tracker
