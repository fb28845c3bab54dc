#include "candidate_observation.h"

namespace mono_pose_tracker {

AbsolutePoseReport pose_by(const Map& map, const Keyframe& keyframe,
                           const std::vector<CandidateObservation>& observations,
                           const AbsolutePoseOptions& options) {
  std::vector<Eigen::Vector3d> bearings, points;
  for (const CandidateObservation& s : observations) {
    bearings.push_back(keyframe.image->set.bearings[s.feature]);
    points.push_back(map.landmark(s.landmark)->x_in_map);
  }
  return estimate_absolute_pose(bearings, points, options);
}

bool is_same_place(const MapperOptions& options, const AbsolutePoseReport& pose) {
  return pose.success && pose.num_inliers >= options.min_inliers &&
         2 * pose.num_inliers >= static_cast<int>(pose.inliers.size());
}

}  // namespace mono_pose_tracker
