#include "epipolar_matcher.h"

#include <limits>

#include "mono_pose_tracker/geometry/essential.h"

namespace mono_pose_tracker {

namespace {

std::vector<int> features_without_landmark(const Keyframe& keyframe) {
  std::vector<int> free;
  for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
    if (keyframe.landmark_of_feature[f] == kNoLandmark) free.push_back(static_cast<int>(f));
  }
  return free;
}

}  // namespace

std::vector<Match> match_along_epipolar_lines(const Keyframe& first, const Keyframe& second,
                                              const EpipolarMatchOptions& options) {
  const Eigen::Matrix3d essential =
      essential_matrix(second.camera_from_map * first.camera_from_map.inverse());
  const std::vector<int> free1 = features_without_landmark(first), free2 = features_without_landmark(second);
  Eigen::Matrix3Xf bearings2(3, free2.size());
  for (std::size_t j = 0; j < free2.size(); ++j) {
    bearings2.col(j) = second.image->set.bearings[free2[j]].cast<float>();
  }
  std::vector<NearestTwo> of_first(free1.size()), of_second(free2.size());
  Eigen::RowVectorXf from_plane(free2.size());
  // Scales are in px of each image's own camera.
  const double same_px = first.image->camera.focal() / second.image->camera.focal();
  for (std::size_t i = 0; i < free1.size(); ++i) {
    if (is_set(options.cancelled)) return {};
    const Eigen::Vector3d normal = essential * first.image->set.bearings[free1[i]];
    const double length = normal.norm();
    if (length < 1e-9) continue;  // at the epipole every line passes
    from_plane.noalias() = (normal / length).cast<float>().transpose() * bearings2;
    const double scale1 = first.image->set.features[free1[i]].scale;
    for (std::size_t j = 0; j < free2.size(); ++j) {
      if (std::abs(from_plane[j]) > options.max_error_rad) continue;
      const double scale2 = same_px * second.image->set.features[free2[j]].scale;
      if (scale1 > options.max_scale_ratio * scale2 || scale2 > options.max_scale_ratio * scale1) continue;
      const int d2 =
          descriptor_distance2(first.image->set.descriptor(free1[i]), second.image->set.descriptor(free2[j]));
      of_first[i].offer(static_cast<int>(j), d2);
      of_second[j].offer(static_cast<int>(i), d2);
    }
  }
  std::vector<Match> matches;
  const double min_ratio2 = options.min_ratio * options.min_ratio;
  for (std::size_t i = 0; i < free1.size(); ++i) {
    const NearestTwo& b = of_first[i];
    if (b.index < 0 || b.best > options.max_distance2 || of_second[b.index].index != static_cast<int>(i))
      continue;
    if (b.second != std::numeric_limits<int>::max() && b.best * min_ratio2 > b.second) continue;
    matches.push_back({free1[i], free2[b.index], b.best, 0});
  }
  return matches;
}

}  // namespace mono_pose_tracker
