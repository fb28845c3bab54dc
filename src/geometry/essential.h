#pragma once

#include <Eigen/Core>
#include <array>

#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

/// E = [t]x R of second_from_first = (R, t), of Frobenius norm 1 (t of any non-zero length).
Eigen::Matrix3d essential_matrix(const Rigid3& second_from_first);

/// The four poses of an essential matrix (Nister 2004, section 3.1), translations of unit length. False when
/// E is not finite or zero.
bool decompose_essential(const Eigen::Matrix3d& essential, std::array<Rigid3, 4>* seconds_from_first);

/// Signed Sampson error of a pair of unit bearings on the unit sphere, in radians (small angles).
double sampson_error(const Eigen::Matrix3d& essential, const Eigen::Vector3d& bearing1,
                     const Eigen::Vector3d& bearing2);

/// True when the rays of the pair meet in front of both cameras (at a positive distance along both bearings).
bool is_in_front(const Rigid3& second_from_first, const Eigen::Vector3d& bearing1,
                 const Eigen::Vector3d& bearing2);

}  // namespace mono_pose_tracker
