#pragma once

#include <memory>

#include "mono_pose_tracker/features/sift.h"

namespace mono_pose_tracker {

std::unique_ptr<FeatureExtractor> make_own_sift(const SiftOptions& options);

}  // namespace mono_pose_tracker
