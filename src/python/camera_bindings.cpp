#include <pybind11/stl.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "bindings.h"
#include "camera/camera_parameters.h"
#include "io/byte_stream.h"
#include "mono_pose_tracker/io/camera_yaml.h"

namespace mono_pose_tracker {
namespace {

namespace fs = std::filesystem;

/// How COLMAP's parameters of a model stand: where fx, fy, cx, cy are, and where each coefficient of ours is
/// (-1: it is zero).
struct ColmapCameraLayout {
  std::size_t count;
  std::array<std::size_t, 4> pinhole;
  const char* distortion_model;
  std::vector<int> coefficients;
};

const std::map<std::string, ColmapCameraLayout>& colmap_layouts() {
  static const std::map<std::string, ColmapCameraLayout> layouts = {
      {"SIMPLE_PINHOLE", {3, {0, 0, 1, 2}, "plumb_bob", {}}},
      {"PINHOLE", {4, {0, 1, 2, 3}, "plumb_bob", {}}},
      {"SIMPLE_RADIAL", {4, {0, 0, 1, 2}, "plumb_bob", {3, -1, -1, -1, -1}}},
      {"RADIAL", {5, {0, 0, 1, 2}, "plumb_bob", {3, 4, -1, -1, -1}}},
      {"OPENCV", {8, {0, 1, 2, 3}, "plumb_bob", {4, 5, 6, 7, -1}}},
      {"FULL_OPENCV", {12, {0, 1, 2, 3}, "rational_polynomial", {4, 5, 6, 7, 8, 9, 10, 11}}},
      {"OPENCV_FISHEYE", {8, {0, 1, 2, 3}, "equidistant", {4, 5, 6, 7}}}};
  return layouts;
}

CameraParameters camera_of_colmap_line(const std::string& path, const std::string& line) {
  std::istringstream words(line);
  words.imbue(std::locale::classic());
  long id = 0;
  std::string model;
  CameraParameters camera;
  words >> id >> model >> camera.width >> camera.height;
  const auto found = colmap_layouts().find(model);
  std::vector<double> values;
  for (double value = 0; words >> value;) values.push_back(value);
  if (found == colmap_layouts().end() || values.size() != found->second.count) {
    throw std::runtime_error(path + ": camera '" + line.substr(0, 200) +
                             "': expected `id model width height parameters` with a model of SIMPLE_PINHOLE, "
                             "PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, FULL_OPENCV, OPENCV_FISHEYE");
  }
  const ColmapCameraLayout& layout = found->second;
  camera.fx = values[layout.pinhole[0]];
  camera.fy = values[layout.pinhole[1]];
  camera.cx = values[layout.pinhole[2]] - 0.5;  // COLMAP has the centre of the first pixel at (0.5, 0.5)
  camera.cy = values[layout.pinhole[3]] - 0.5;
  camera.distortion_model = layout.distortion_model;
  for (const int at : layout.coefficients) {
    camera.distortion.push_back(at < 0 ? 0 : values[static_cast<std::size_t>(at)]);
  }
  return camera;
}

/// The lines of cameras.txt for the content of cameras.bin.
std::vector<std::string> lines_of_binary(std::string_view bytes) {
  // By COLMAP's numbers of the models; a number of parameters is needed to pass over a camera.
  static const std::vector<std::pair<const char*, int>> models = {{"SIMPLE_PINHOLE", 3},
                                                                  {"PINHOLE", 4},
                                                                  {"SIMPLE_RADIAL", 4},
                                                                  {"RADIAL", 5},
                                                                  {"OPENCV", 8},
                                                                  {"OPENCV_FISHEYE", 8},
                                                                  {"FULL_OPENCV", 12},
                                                                  {"FOV", 5},
                                                                  {"SIMPLE_RADIAL_FISHEYE", 4},
                                                                  {"RADIAL_FISHEYE", 5},
                                                                  {"THIN_PRISM_FISHEYE", 12}};
  std::vector<std::string> lines;
  ByteReader in(bytes);
  for (std::uint64_t left = in.u64(); left > 0; --left) {
    std::ostringstream line;
    line.imbue(std::locale::classic());
    line.precision(std::numeric_limits<double>::max_digits10);
    line << in.u32();
    const std::uint32_t model = in.u32();
    if (model >= models.size())
      throw std::runtime_error("camera model " + std::to_string(model) + ", expected 0 to 10");
    line << ' ' << models[model].first;
    for (int i = 0; i < 2; ++i) line << ' ' << in.u64();
    for (int i = 0; i < models[model].second; ++i) line << ' ' << in.f64();
    lines.push_back(line.str());
  }
  return lines;
}

std::vector<std::string> lines_of_colmap(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream content;
  if (!file || !(content << file.rdbuf())) {
    throw std::runtime_error(path.string() +
                             ": cannot be read: expected COLMAP's cameras.txt or cameras.bin");
  }
  if (path.extension() == ".bin") {
    try {
      return lines_of_binary(content.str());
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(path.string() + ": cannot be read as COLMAP's cameras.bin: " + error.what());
    }
  }
  std::vector<std::string> lines;
  std::istringstream text(content.str());
  for (std::string line; std::getline(text, line);) {
    if (!line.empty() && line[0] != '#') lines.push_back(line);
  }
  return lines;
}

CameraModel camera_of_colmap(const py::object& where, std::optional<long> id) {
  fs::path path = path_of(where);
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    const bool is_binary =
        !fs::exists(path / "cameras.txt", ignored) && fs::exists(path / "cameras.bin", ignored);
    path /= is_binary ? "cameras.bin" : "cameras.txt";
  }
  std::vector<std::string> lines;
  for (const std::string& line : lines_of_colmap(path)) {
    std::istringstream words(line);
    long found = 0;
    if ((words >> found) && (!id || *id == found)) lines.push_back(line);
  }
  if (lines.size() != 1) {
    throw std::runtime_error(path.string() + ": holds " + std::to_string(lines.size()) + " cameras" +
                             (id ? " of the id " + std::to_string(*id) : "") +
                             ": expected one, or camera_id to select one");
  }
  return CameraModel(camera_of_colmap_line(path.string(), lines.front()));
}

DoubleArray project(const CameraModel& camera, const DoubleArray& points) {
  const std::vector<Eigen::Vector3d> rows = points_of(points, "points");
  DoubleArray pixels({static_cast<py::ssize_t>(rows.size()), py::ssize_t{2}});
  auto values = pixels.mutable_unchecked<2>();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    Eigen::Vector2d pixel = Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
    camera.project(rows[i], &pixel);
    for (int k = 0; k < 2; ++k) values(static_cast<py::ssize_t>(i), k) = pixel[k];
  }
  return pixels;
}

DoubleArray bearings(const CameraModel& camera, const DoubleArray& pixels) {
  if (pixels.ndim() != 2 || pixels.shape(1) != 2) {
    throw std::invalid_argument("pixels: expected the shape (n, 2)");
  }
  DoubleArray result({pixels.shape(0), py::ssize_t{3}});
  const auto from = pixels.unchecked<2>();
  auto values = result.mutable_unchecked<2>();
  for (py::ssize_t i = 0; i < from.shape(0); ++i) {
    const Eigen::Vector3d bearing = camera.bearing({from(i, 0), from(i, 1)});
    for (int k = 0; k < 3; ++k) values(i, k) = bearing[k];
  }
  return result;
}

DoubleArray camera_matrix(const CameraModel& camera) {
  const CameraParameters& p = camera.parameters();
  DoubleArray matrix({py::ssize_t{3}, py::ssize_t{3}});
  auto values = matrix.mutable_unchecked<2>();
  const double entries[3][3] = {{p.fx, 0, p.cx}, {0, p.fy, p.cy}, {0, 0, 1}};
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) values(r, c) = entries[r][c];
  }
  return matrix;
}

std::string described(const CameraModel& camera) {
  const CameraParameters& p = camera.parameters();
  std::ostringstream text;
  text << "Camera(" << p.width << ", " << p.height << ", fx=" << p.fx << ", fy=" << p.fy << ", cx=" << p.cx
       << ", cy=" << p.cy << ", distortion_model='" << p.distortion_model << "', distortion=[";
  for (std::size_t i = 0; i < p.distortion.size(); ++i) text << (i > 0 ? ", " : "") << p.distortion[i];
  text << "])";
  return text.str();
}

}  // namespace

void bind_camera(py::module_& module) {
  py::class_<CameraModel> camera(module, "Camera",
                                 "A calibrated camera. Axes are optical: x right, y down, z forward; the "
                                 "centre of the first pixel is (0, 0).");
  camera
      .def(
          py::init([](int width, int height, double fx, double fy, double cx, double cy,
                      const std::string& distortion_model, const std::vector<double>& distortion) {
            return CameraModel(CameraParameters{width, height, fx, fy, cx, cy, distortion_model, distortion});
          }),
          py::arg("width"), py::arg("height"), py::arg("fx"), py::arg("fy"), py::arg("cx"), py::arg("cy"),
          py::arg("distortion_model") = "plumb_bob", py::arg("distortion") = std::vector<double>(),
          "Sizes, focal lengths and principal point in pixels. distortion: k1 k2 p1 p2 k3 of plumb_bob, k1 "
          "... k6 of rational_polynomial (k1 k2 p1 p2 k3 k4 k5 k6), or the four coefficients of equidistant.")
      .def_static(
          "from_yaml",
          [](const py::object& path, bool rectified) {
            return CameraModel(read_calibration_yaml(path_of(path), rectified).camera);
          },
          py::arg("path"), py::arg("rectified") = false,
          "Reads the YAML file that ROS camera_calibration writes. rectified: return the camera of the "
          "rectified images.")
      .def_static(
          "from_hfov",
          [](int width, int height, double hfov_deg) {
            return CameraModel(guess_camera(width, height, hfov_deg));
          },
          py::arg("width"), py::arg("height"), py::arg("hfov_deg"),
          "A camera without distortion, guessed from its horizontal field of view (degrees).")
      .def_static(
          "from_colmap", &camera_of_colmap, py::arg("path"), py::arg("camera_id") = py::none(),
          "Reads COLMAP's cameras.txt or cameras.bin, or the one in a given folder. camera_id: needed if "
          "the file has several cameras.")
      .def(
          "project", &project, py::arg("points"),
          "Projects points (n, 3) in the camera frame to pixels (n, 2); NaN for points that are not in view.")
      .def("bearings", &bearings, py::arg("pixels"),
           "Converts pixels (n, 2) to unit bearings (n, 3), with the distortion removed.")
      .def_property_readonly("matrix", &camera_matrix, "The camera matrix (3, 3).")
      .def_property_readonly("width", &CameraModel::width, "px")
      .def_property_readonly("height", &CameraModel::height, "px")
      .def_property_readonly(
          "distortion_model", [](const CameraModel& c) { return c.parameters().distortion_model; },
          "plumb_bob, rational_polynomial or equidistant")
      .def_property_readonly(
          "distortion", [](const CameraModel& c) { return c.parameters().distortion; },
          "the coefficients, in the order of the constructor")
      .def("__repr__", &described);
}

}  // namespace mono_pose_tracker
