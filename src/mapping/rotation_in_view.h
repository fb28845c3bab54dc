#pragma once

#include <Eigen/Core>
#include <vector>

namespace mono_pose_tracker {

/// Rotation of an object in front of the camera between two images, from matched bearings (one pair for each
/// match): the motion within the object that no camera rotation explains, divided by its size in the image
/// (medians). It is about a third of the rotation angle (rad) for a ball, and up to 0.6 of it for a long,
/// flat object.
double rotation_in_view(const std::vector<Eigen::Vector3d>& bearings1,
                        const std::vector<Eigen::Vector3d>& bearings2);

}  // namespace mono_pose_tracker
