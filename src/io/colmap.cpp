#include "mono_pose_tracker/io/colmap.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "io/atomic_file.h"

namespace mono_pose_tracker {
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

}  // namespace mono_pose_tracker
