#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <utility>

#include "byte_stream.h"
#include "io/colmap_binary.h"
#include "io/files.h"
#include "mono_pose_tracker/io/colmap.h"
#include "mono_pose_tracker/io/ply.h"

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

namespace {

// From our pixel coordinates to COLMAP's.
constexpr double kPixelCentre = 0.5;

// A number in full, as a stream writes it with 17 digits, in a fifth of the time.
struct Full {
  double value;
};

std::ostream& operator<<(std::ostream& out, Full number) {
#ifdef __cpp_lib_to_chars
  std::array<char, 32> text;
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), number.value, std::chars_format::general, 17);
  return out.write(text.data(), end.ptr - text.data());
#else  // before gcc 11 of whole numbers only
  out.precision(17);
  return out << number.value;
#endif
}

struct ColmapCamera {
  std::string model;
  std::vector<double> parameters;
};

/// The simplest of COLMAP's models that represents the camera.
ColmapCamera colmap_camera(const CameraParameters& camera) {
  const std::vector<double>& d = camera.distortion;
  std::vector<double> parameters = {camera.fx, camera.fy, camera.cx + kPixelCentre, camera.cy + kPixelCentre};
  const auto with = [&](const char* model, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) parameters.push_back(i < d.size() ? d[i] : 0.0);
    return ColmapCamera{model, parameters};
  };
  const auto zero_from = [&](std::size_t first) {
    return std::all_of(d.begin() + std::min(first, d.size()), d.end(),
                       [](double value) { return value == 0; });
  };
  if (camera.distortion_model == "equidistant") return with("OPENCV_FISHEYE", 4);
  if (zero_from(0)) return with("PINHOLE", 0);
  if (zero_from(4)) return with("OPENCV", 4);
  return with("FULL_OPENCV", 8);
}

void write_camera(std::ostream& out, const CameraParameters& camera) {
  const ColmapCamera model = colmap_camera(camera);
  out << "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n1 " << model.model << ' ' << camera.width << ' '
      << camera.height;
  for (double value : model.parameters) out << ' ' << Full{value};
  out << '\n';
}

void write_observation(std::ostream& out, const ColmapObservation& observation) {
  out << Full{observation.pixel.x() + kPixelCentre} << ' ' << Full{observation.pixel.y() + kPixelCentre}
      << ' ' << (observation.point < 0 ? -1 : observation.point + 1);
}

void write_images(std::ostream& out, const CameraParameters& camera, const std::vector<ColmapImage>& images) {
  // Many programs stop at an empty line, or pass over it and take every line after it for another's.
  const ColmapObservation of_no_point = {{0.5 * (camera.width - 1), 0.5 * (camera.height - 1)}, -1};
  out << "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n# POINTS2D[] as X Y POINT3D_ID\n";
  for (std::size_t i = 0; i < images.size(); ++i) {
    const Eigen::Quaterniond& q = images[i].camera_from_map.rotation;
    const Eigen::Vector3d& t = images[i].camera_from_map.translation;
    out << i + 1;
    for (double value : {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}) out << ' ' << Full{value};
    out << " 1 " << images[i].name << '\n';
    const char* separator = "";
    for (const ColmapObservation& observation : images[i].observations) {
      out << separator;
      write_observation(out, observation);
      separator = " ";
    }
    if (images[i].observations.empty()) write_observation(out, of_no_point);
    out << '\n';
  }
}

/// (image id, index of the observation in the image) of each point's observations.
using Tracks = std::vector<std::vector<std::pair<std::size_t, std::size_t>>>;

Tracks tracks_of(const std::vector<ColmapImage>& images, std::size_t num_points) {
  Tracks tracks(num_points);
  for (std::size_t i = 0; i < images.size(); ++i) {
    for (std::size_t k = 0; k < images[i].observations.size(); ++k) {
      const int point = images[i].observations[k].point;
      if (point < 0) continue;
      if (static_cast<std::size_t>(point) >= num_points) {
        throw std::invalid_argument("image " + images[i].name + " observes point " + std::to_string(point) +
                                    ": expected less than " + std::to_string(num_points));
      }
      tracks[point].emplace_back(i + 1, k);
    }
  }
  return tracks;
}

void write_points(std::ostream& out, const std::vector<ColmapPoint>& points, const Tracks& tracks) {
  out << "# POINT3D_ID X Y Z R G B ERROR TRACK[] as IMAGE_ID POINT2D_IDX\n";
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ColmapPoint& point = points[i];
    out << i + 1;
    for (int axis = 0; axis < 3; ++axis) out << ' ' << Full{point.x_in_map[axis]};
    out << ' ' << int{point.r} << ' ' << int{point.g} << ' ' << int{point.b} << ' ' << Full{point.error_px};
    for (const auto& [image_id, observation] : tracks[i]) out << ' ' << image_id << ' ' << observation;
    out << '\n';
  }
}

}  // namespace

void write_colmap_text(const std::string& folder, const CameraParameters& camera,
                       const std::vector<ColmapImage>& images, const std::vector<ColmapPoint>& points) {
  const Tracks tracks = tracks_of(images, points.size());
  const std::filesystem::path path(folder);
  make_folder(folder);
  const auto write = [&](const char* name, const auto& content) {
    write_file_atomically((path / name).string(), [&](std::ostream& out) { content(out); });
  };
  write("cameras.txt", [&](std::ostream& out) { write_camera(out, camera); });
  write("images.txt", [&](std::ostream& out) { write_images(out, camera, images); });
  write("points3D.txt", [&](std::ostream& out) { write_points(out, points, tracks); });
}

namespace {

constexpr std::uint32_t kCameraId = 1;

void require_pinhole(const CameraParameters& camera) {
  const bool is_distorted = std::any_of(camera.distortion.begin(), camera.distortion.end(),
                                        [](double value) { return value != 0; });
  if (is_distorted || camera.distortion_model == "equidistant") {
    throw std::invalid_argument("the binary COLMAP model has a pinhole camera: expected no distortion");
  }
}

std::string camera_bytes(const CameraParameters& camera) {
  ByteWriter out;
  out.u64(1);
  out.u32(kCameraId);
  out.i32(1);  // the id of the model PINHOLE
  out.u64(static_cast<std::uint64_t>(camera.width));
  out.u64(static_cast<std::uint64_t>(camera.height));
  for (double value : {camera.fx, camera.fy, camera.cx + kPixelCentre, camera.cy + kPixelCentre})
    out.f64(value);
  return out.bytes();
}

std::string image_bytes(const std::vector<ColmapImage>& images) {
  ByteWriter out;
  out.u64(images.size());
  for (std::size_t i = 0; i < images.size(); ++i) {
    const Eigen::Quaterniond& q = images[i].camera_from_map.rotation;
    const Eigen::Vector3d& t = images[i].camera_from_map.translation;
    out.u32(static_cast<std::uint32_t>(i + 1));
    for (double value : {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}) out.f64(value);
    out.u32(kCameraId);
    out.raw(images[i].name.c_str(), images[i].name.size() + 1);  // with its zero
    out.u64(images[i].observations.size());
    for (const ColmapObservation& observation : images[i].observations) {
      out.f64(observation.pixel.x() + kPixelCentre);
      out.f64(observation.pixel.y() + kPixelCentre);
      out.u64(observation.point < 0 ? std::numeric_limits<std::uint64_t>::max()  // COLMAP's invalid id
                                    : static_cast<std::uint64_t>(observation.point) + 1);
    }
  }
  return out.bytes();
}

std::string point_bytes(const std::vector<ColmapPoint>& points, const Tracks& tracks) {
  ByteWriter out;
  out.u64(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    out.u64(i + 1);
    for (int axis = 0; axis < 3; ++axis) out.f64(points[i].x_in_map[axis]);
    for (std::uint8_t channel : {points[i].r, points[i].g, points[i].b}) out.u8(channel);
    out.f64(points[i].error_px);
    out.u64(tracks[i].size());
    for (const auto& [image_id, observation] : tracks[i]) {
      out.u32(static_cast<std::uint32_t>(image_id));
      out.u32(static_cast<std::uint32_t>(observation));
    }
  }
  return out.bytes();
}

}  // namespace

void write_colmap_binary(const std::string& folder, const CameraParameters& camera,
                         const std::vector<ColmapImage>& images, const std::vector<ColmapPoint>& points) {
  require_pinhole(camera);
  const Tracks tracks = tracks_of(images, points.size());
  make_folder(folder);
  const auto write = [&](const char* name, const std::string& bytes) {
    write_file_atomically((std::filesystem::path(folder) / name).string(),
                          [&](std::ostream& out) { out << bytes; });
  };
  write("cameras.bin", camera_bytes(camera));
  write("images.bin", image_bytes(images));
  write("points3D.bin", point_bytes(points, tracks));
}

}  // namespace mono_pose_tracker
