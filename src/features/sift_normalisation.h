#pragma once

#include <cstdint>

namespace mono_pose_tracker {

constexpr int kDescriptorSize = 128;

/// Scales to unit length, cuts entries at largest_entry (Lowe, section 6.1), scales again. 0 stays 0.
void limit_entries(float largest_entry, float* histogram);

/// A descriptor of any positive scale to bytes. root_sift: sqrt(d / sum(d)), the Hellinger kernel of
/// Arandjelovic and Zisserman (2012); else d / |d|. Either has unit length and is stored times 512, at most
/// 255 (as in Lowe's files).
void quantise_descriptor(const float* histogram, bool root_sift, std::uint8_t* descriptor);

}  // namespace mono_pose_tracker
