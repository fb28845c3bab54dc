#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace mono_pose_tracker {

struct ColoredPoint {
  Eigen::Vector3f x_in_map;
  std::uint8_t r = 0, g = 0, b = 0;
};

enum class PlyFormat { kAscii, kBinary };  // binary: little endian

/// Writes a point cloud: float x y z, uchar red green blue. Throws std::runtime_error naming the path when it
/// cannot.
void write_ply(const std::string& path, const std::vector<ColoredPoint>& points,
               PlyFormat format = PlyFormat::kBinary);

}  // namespace mono_pose_tracker
