#include "mono_pose_tracker/io/ply.h"

#include <cstring>

#include "io/atomic_file.h"

namespace mono_pose_tracker {
namespace {

void write_header(std::ostream& out, std::size_t count, const char* format) {
  out << "ply\nformat " << format << " 1.0\nelement vertex " << count
      << "\nproperty float x\nproperty float y\nproperty float z\n"
         "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
}

void write_little_endian(std::ostream& out, float value) {
  std::uint32_t bits;
  static_assert(sizeof bits == sizeof value, "PLY's float has 32 bits");
  std::memcpy(&bits, &value, sizeof bits);
  for (int shift = 0; shift < 32; shift += 8) out.put(static_cast<char>((bits >> shift) & 0xff));
}

void write_vertex(std::ostream& out, const ColoredPoint& point, PlyFormat format) {
  if (format == PlyFormat::kAscii) {
    out << point.x_in_map.x() << ' ' << point.x_in_map.y() << ' ' << point.x_in_map.z() << ' ' << int{point.r}
        << ' ' << int{point.g} << ' ' << int{point.b} << '\n';
    return;
  }
  for (int i = 0; i < 3; ++i) write_little_endian(out, point.x_in_map[i]);
  for (std::uint8_t channel : {point.r, point.g, point.b}) out.put(static_cast<char>(channel));
}

}  // namespace

void write_ply(const std::string& path, const std::vector<ColoredPoint>& points, PlyFormat format) {
  write_file_atomically(path, [&](std::ostream& out) {
    write_header(out, points.size(), format == PlyFormat::kAscii ? "ascii" : "binary_little_endian");
    out.precision(9);  // enough for a float to come back the same
    for (const ColoredPoint& point : points) write_vertex(out, point, format);
  });
}

}  // namespace mono_pose_tracker
