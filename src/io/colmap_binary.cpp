#include "io/colmap_binary.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <utility>

#include "byte_stream.h"
#include "io/atomic_file.h"

namespace mono_pose_tracker {
namespace {

constexpr std::int32_t kPinholeModel = 1;                                      // COLMAP's model id
constexpr double kHalfPixel = 0.5;                                             // to COLMAP's pixels
constexpr std::uint64_t kNoPoint = std::numeric_limits<std::uint64_t>::max();  // COLMAP's invalid id
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
  out.i32(kPinholeModel);
  out.u64(static_cast<std::uint64_t>(camera.width));
  out.u64(static_cast<std::uint64_t>(camera.height));
  for (double value : {camera.fx, camera.fy, camera.cx + kHalfPixel, camera.cy + kHalfPixel}) out.f64(value);
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
      out.f64(observation.pixel.x() + kHalfPixel);
      out.f64(observation.pixel.y() + kHalfPixel);
      out.u64(observation.point < 0 ? kNoPoint : static_cast<std::uint64_t>(observation.point) + 1);
    }
  }
  return out.bytes();
}

/// (image id, index of the observation in the image) of each point's observations.
using BinaryTracks = std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>>;

BinaryTracks binary_tracks(const std::vector<ColmapImage>& images, std::size_t num_points) {
  BinaryTracks tracks(num_points);
  for (std::size_t i = 0; i < images.size(); ++i) {
    for (std::size_t k = 0; k < images[i].observations.size(); ++k) {
      const int point = images[i].observations[k].point;
      if (point < 0) continue;
      if (static_cast<std::size_t>(point) >= num_points) {
        throw std::invalid_argument("image " + images[i].name + " observes point " + std::to_string(point) +
                                    ": expected less than " + std::to_string(num_points));
      }
      tracks[point].emplace_back(static_cast<std::uint32_t>(i + 1), static_cast<std::uint32_t>(k));
    }
  }
  return tracks;
}

std::string point_bytes(const std::vector<ColmapPoint>& points, const BinaryTracks& tracks) {
  ByteWriter out;
  out.u64(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    out.u64(i + 1);
    for (int axis = 0; axis < 3; ++axis) out.f64(points[i].x_in_map[axis]);
    for (std::uint8_t channel : {points[i].r, points[i].g, points[i].b}) out.u8(channel);
    out.f64(points[i].error_px);
    out.u64(tracks[i].size());
    for (const auto& [image_id, observation] : tracks[i]) {
      out.u32(image_id);
      out.u32(observation);
    }
  }
  return out.bytes();
}

}  // namespace

void write_colmap_binary(const std::string& folder, const CameraParameters& camera,
                         const std::vector<ColmapImage>& images, const std::vector<ColmapPoint>& points) {
  require_pinhole(camera);
  const BinaryTracks tracks = binary_tracks(images, points.size());
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
