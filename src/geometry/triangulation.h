#pragma once

#include <Eigen/Core>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

/// The point whose angular errors to both unit bearings are least, to first order (Lee and Civera,
/// "Triangulation: why optimize?", BMVC 2019: weighted midpoint), in the first camera's frame. False when the
/// rays are parallel or meet behind a camera.
bool triangulate_two_views(const Rigid3& second_from_first, const Eigen::Vector3d& bearing1,
                           const Eigen::Vector3d& bearing2, Eigen::Vector3d* x_in_first);

/// The point with the least sum of squared angular errors over all views: linear start, Gauss-Newton
/// refinement. cameras_from_map[i] sees the unit bearings[i]. False when it is not determined or lies behind
/// a camera.
bool triangulate_multi_view(const std::vector<Rigid3>& cameras_from_map,
                            const std::vector<Eigen::Vector3d>& bearings, Eigen::Vector3d* x_in_map);

/// Common direction of the bearings as a unit vector in the map's frame, for points too far away to be
/// triangulated.
Eigen::Vector3d common_direction(const std::vector<Rigid3>& cameras_from_map,
                                 const std::vector<Eigen::Vector3d>& bearings);

/// Angle in radians between the rays from two camera centres to a point.
double parallax_angle(const Eigen::Vector3d& x_in_map, const Eigen::Vector3d& center1_in_map,
                      const Eigen::Vector3d& center2_in_map);

}  // namespace mono_pose_tracker
