#pragma once

#include <Eigen/Core>
#include <vector>

namespace mono_pose_tracker {

struct RotationInViewOptions {
  int rounds = 3;  // of fitting a rotation without the far matches
  double far = 3;  // medians, beyond which a match is ignored: a few wrong ones move farther than all others
                   // together
};

/// Rotation of an object in front of the camera between two images, from matched bearings (one pair for each
/// match): the motion within the object that no camera rotation explains, divided by its size in the image
/// (medians). It is about a third of the rotation angle (rad) for a ball, and up to 0.6 of it for a long,
/// flat object.
double rotation_in_view(const std::vector<Eigen::Vector3d>& bearings1,
                        const std::vector<Eigen::Vector3d>& bearings2,
                        const RotationInViewOptions& options = {});

}  // namespace mono_pose_tracker
