#pragma once

#include <array>

namespace mono_pose_tracker {

// Mean of 36,000 root-SIFT descriptors of images that simulate_sequence rendered (--scene room --noise 2). It
// is subtracted before descriptors are compared by sign, as common components do not discriminate. The mean
// hardly depends on the scene (more at the centre, more along the main direction). It is not learnt from the
// recording, so codes never change.
constexpr std::array<int, 128> kDescriptorMean = {
    // clang-format off
    37, 27, 23, 26, 32, 32, 34, 36,
    54, 39, 28, 27, 29, 30, 35, 44,
    53, 44, 35, 32, 31, 27, 27, 37,
    35, 35, 33, 34, 35, 28, 23, 26,
    45, 31, 27, 33, 41, 38, 35, 37,
    76, 48, 31, 33, 37, 36, 36, 51,
    75, 51, 37, 39, 40, 33, 30, 46,
    43, 36, 35, 39, 43, 34, 26, 29,
    45, 38, 36, 39, 40, 32, 26, 30,
    76, 51, 36, 37, 38, 32, 30, 47,
    74, 46, 30, 32, 40, 39, 36, 50,
    43, 29, 26, 33, 42, 40, 35, 36,
    36, 36, 34, 33, 33, 27, 23, 27,
    54, 45, 34, 30, 30, 27, 27, 38,
    52, 38, 28, 27, 32, 32, 34, 43,
    34, 26, 24, 28, 34, 33, 32, 34,
    // clang-format on
};

}  // namespace mono_pose_tracker
