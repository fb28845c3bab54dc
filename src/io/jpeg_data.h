#pragma once

#include <vector>

namespace mono_pose_tracker {

/// True when the coded data of a JPEG end before its last pixel, whatever stands behind them: libjpeg makes
/// up the rest in grey, and warns. Costs a third to a half of decoding. What is no JPEG, or one that libjpeg
/// refuses, is left to whoever decodes it: false.
bool jpeg_data_end_early(const std::vector<unsigned char>& bytes);

}  // namespace mono_pose_tracker
