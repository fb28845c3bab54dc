#pragma once

#include <string>
#include <vector>

#include "mono_pose_tracker/common/colored_point.h"

namespace mono_pose_tracker {

enum class PlyFormat { kAscii, kBinary };  // binary: little endian

/// Writes a point cloud: float x y z, uchar red green blue. Throws std::runtime_error naming the path when it
/// cannot.
void write_ply(const std::string& path, const std::vector<ColoredPoint>& points,
               PlyFormat format = PlyFormat::kBinary);

}  // namespace mono_pose_tracker
