#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <type_traits>

#include "bindings.h"
#include "mono_pose_tracker/geometry/five_point.h"
#include "mono_pose_tracker/geometry/p3p.h"
#include "mono_pose_tracker/geometry/seven_point.h"
#include "mono_pose_tracker/robust/absolute_pose.h"
#include "mono_pose_tracker/robust/relative_pose.h"

namespace mono_pose_tracker {

namespace {

using Rows = std::vector<Eigen::Vector3d>;

template <std::size_t Count>
std::array<Eigen::Vector3d, Count> some_rows(const Rows& rows) {
  std::array<Eigen::Vector3d, Count> result;
  std::copy_n(rows.begin(), Count, result.begin());
  return result;
}

Rows unit_rows(Rows rows) {
  for (Eigen::Vector3d& row : rows) row.normalize();
  return rows;
}

template <typename Matrices>
DoubleArray matrices_3x3(const Matrices& matrices, int count) {
  DoubleArray array({static_cast<py::ssize_t>(count), py::ssize_t{3}, py::ssize_t{3}});
  auto values = array.mutable_unchecked<3>();
  for (int i = 0; i < count; ++i) {
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) values(i, r, c) = matrices[static_cast<std::size_t>(i)](r, c);
    }
  }
  return array;
}

DoubleArray solve_five_point(const DoubleArray& x1, const DoubleArray& x2) {
  std::array<Eigen::Matrix3d, 10> essentials;
  const Rows first = rows_of(x1, "x1", 5), second = rows_of(x2, "x2", 5);
  const int count = five_point(some_rows<5>(first), some_rows<5>(second), &essentials);
  return matrices_3x3(essentials, count);
}

DoubleArray solve_seven_point(const DoubleArray& x1, const DoubleArray& x2) {
  std::array<Eigen::Matrix3d, 3> fundamentals;
  const Rows first = rows_of(x1, "x1", 7), second = rows_of(x2, "x2", 7);
  const int count = seven_point(some_rows<7>(first), some_rows<7>(second), &fundamentals);
  return matrices_3x3(fundamentals, count);
}

DoubleArray solve_p3p(const DoubleArray& x, const DoubleArray& points) {
  std::array<Motion, 4> motions;
  const Rows bearings = unit_rows(rows_of(x, "x", 3)), in_map = points_of(points, "points", 3);
  const int count = p3p(some_rows<3>(bearings), some_rows<3>(in_map), &motions);
  std::vector<Rigid3> poses;
  for (int i = 0; i < count; ++i) {
    poses.emplace_back(motions[static_cast<std::size_t>(i)].rotation,
                       motions[static_cast<std::size_t>(i)].translation);
  }
  return matrices_of(poses);
}

/// Bearings of pixels of a camera; without one, of points of the normalised image plane, or of bearings.
Rows bearings_of(const DoubleArray& array, const CameraModel* camera, const char* name) {
  Rows rows = rows_of(array, name);
  if (camera && array.shape(1) != 2) {
    throw std::invalid_argument(std::string(name) +
                                ": expected pixels of the shape (n, 2), because a camera is given");
  }
  for (Eigen::Vector3d& row : rows) {
    row = camera ? camera->bearing(row.head<2>()) : row.normalized().eval();
  }
  return rows;
}

template <typename Number>
Number ransac_number(const std::string& key, const py::handle& value) {
  try {
    return value.cast<Number>();
  } catch (const py::cast_error&) {
    const char* const expected = std::is_floating_point_v<Number> ? "a number"
                                 : std::is_unsigned_v<Number>     ? "a whole number from 0 on"
                                                                  : "a whole number";
    throw std::invalid_argument("ransac: " + key + " = " + std::string(py::str(value)) + ": expected " +
                                expected);
  }
}

/// The options of RansacOptions by their names, and threshold_px.
RansacOptions ransac_options_of(const py::object& ransac, double focal_px) {
  RansacOptions options;
  if (focal_px > 0) options.threshold = 1 / focal_px;
  if (ransac.is_none()) return options;
  if (!py::isinstance<py::dict>(ransac)) throw std::invalid_argument("ransac: expected a dict or None");
  for (const auto& [name, value] : ransac.cast<py::dict>()) {
    const std::string key = py::str(name);
    if (key == "threshold") {
      options.threshold = ransac_number<double>(key, value);
    } else if (key == "threshold_px") {
      if (!(focal_px > 0)) throw std::invalid_argument("ransac: threshold_px needs a camera");
      options.threshold = ransac_number<double>(key, value) / focal_px;
    } else if (key == "confidence") {
      options.confidence = ransac_number<double>(key, value);
    } else if (key == "min_iterations") {
      options.min_iterations = ransac_number<int>(key, value);
    } else if (key == "max_iterations") {
      options.max_iterations = ransac_number<int>(key, value);
    } else if (key == "seed") {
      options.seed = ransac_number<std::uint64_t>(key, value);
    } else {
      throw std::invalid_argument(
          "ransac: the key '" + key +
          "' is unknown: expected threshold, threshold_px, confidence, min_iterations, "
          "max_iterations or seed");
    }
  }
  options.validate();
  return options;
}

struct PoseEstimate {
  bool success = false;
  Rigid3 pose;
  std::vector<char> inliers;
  int num_inliers = 0, iterations = 0;
  double score = 0;
};

py::array_t<bool> flags_of(const std::vector<char>& flags) {
  py::array_t<bool> array(static_cast<py::ssize_t>(flags.size()));
  std::transform(flags.begin(), flags.end(), array.mutable_data(), [](char flag) { return flag != 0; });
  return array;
}

void require_same_length(const Rows& a, const Rows& b, const char* names) {
  if (a.size() != b.size()) {
    throw std::invalid_argument(std::string(names) + " have " + std::to_string(a.size()) + " and " +
                                std::to_string(b.size()) + " rows: expected the same number");
  }
}

PoseEstimate relative_pose(const DoubleArray& x1, const DoubleArray& x2, const CameraModel* camera1,
                           const CameraModel* camera2, const py::object& ransac) {
  if (!camera2) camera2 = camera1;
  const Rows first = bearings_of(x1, camera1, "x1"), second = bearings_of(x2, camera2, "x2");
  require_same_length(first, second, "x1 and x2");
  RelativePoseOptions options;
  options.ransac = ransac_options_of(ransac, camera1 ? 0.5 * (camera1->focal() + camera2->focal()) : 0);
  RelativePoseReport report;
  {
    const py::gil_scoped_release unlocked;
    report = estimate_relative_pose(first, second, options);
  }
  PoseEstimate estimate;
  estimate.success = report.success;
  estimate.iterations = report.iterations;
  estimate.inliers.assign(first.size(), 0);
  if (!report.hypotheses.empty()) {
    const RelativePoseHypothesis& best = report.hypotheses.front();
    estimate.pose = best.second_from_first;
    estimate.inliers = best.inliers;
    estimate.num_inliers = best.num_inliers;
    estimate.score = best.score;
  }
  return estimate;
}

PoseEstimate absolute_pose(const DoubleArray& x, const DoubleArray& points, const CameraModel* camera,
                           const py::object& ransac) {
  const Rows bearings = bearings_of(x, camera, "x"), in_map = points_of(points, "points");
  require_same_length(bearings, in_map, "x and points");
  AbsolutePoseOptions options;
  options.ransac = ransac_options_of(ransac, camera ? camera->focal() : 0);
  AbsolutePoseReport report;
  {
    const py::gil_scoped_release unlocked;
    report = estimate_absolute_pose(bearings, in_map, options);
  }
  return {report.success,     report.camera_from_map, std::move(report.inliers),
          report.num_inliers, report.iterations,      report.score};
}

}  // namespace

void bind_solvers(py::module_& module) {
  module.def("five_point", &solve_five_point, py::arg("x1"), py::arg("x2"),
             "Returns essential matrices (k, 3, 3), k <= 10, with x2^T E x1 = 0. x1, x2: five matches, as "
             "(5, 2) normalised image coordinates or (5, 3) bearings.");
  module.def("seven_point", &solve_seven_point, py::arg("x1"), py::arg("x2"),
             "Returns fundamental matrices (k, 3, 3), k <= 3, with x2^T F x1 = 0. x1, x2: seven matches, (7, "
             "2) or (7, 3).");
  module.def("p3p", &solve_p3p, py::arg("x"), py::arg("points"),
             "Returns poses camera_from_map (k, 4, 4), k <= 4. x: (3, 2) normalised image coordinates or (3, "
             "3) bearings; points: (3, 3).");
  py::class_<PoseEstimate>(module, "PoseEstimate", "The result of a pose estimator.")
      .def_readonly("success", &PoseEstimate::success, "whether a pose was found")
      .def_property_readonly(
          "pose", [](const PoseEstimate& e) { return matrix_of(e.pose); },
          "(4, 4): second_from_first with a translation of length 1, or camera_from_map in the unit of the "
          "points; the identity if success is False")
      .def_property_readonly(
          "inliers", [](const PoseEstimate& e) { return flags_of(e.inliers); }, "(n,) of bool")
      .def_readonly("num_inliers", &PoseEstimate::num_inliers, "number of inliers")
      .def_readonly("iterations", &PoseEstimate::iterations, "number of samples that RANSAC drew")
      .def_readonly("score", &PoseEstimate::score, "MSAC, rad^2; smaller is better");
  const char* const ransac_text =
      " ransac: a dict of threshold (rad) or threshold_px (1 px by default, 0.003 rad without a camera), "
      "confidence, min_iterations, max_iterations, seed.";
  module.def("estimate_relative_pose", &relative_pose, py::arg("x1"), py::arg("x2"),
             py::arg("camera1") = static_cast<CameraModel*>(nullptr),
             py::arg("camera2") = static_cast<CameraModel*>(nullptr), py::arg("ransac") = py::none(),
             (std::string("Estimates second_from_first from matches by RANSAC and the 5-point solver. x1, "
                          "x2: pixels (n, 2) of camera1 and camera2 (default: camera1); without cameras, (n, "
                          "2) normalised image coordinates or (n, 3) bearings.") +
              ransac_text)
                 .c_str());
  module.def(
      "estimate_absolute_pose", &absolute_pose, py::arg("x"), py::arg("points"),
      py::arg("camera") = static_cast<CameraModel*>(nullptr), py::arg("ransac") = py::none(),
      (std::string("Estimates camera_from_map from matches by RANSAC and the P3P solver. x: pixels (n, 2) of "
                   "the camera; without a camera as in estimate_relative_pose; points: (n, 3) in the map.") +
       ransac_text)
          .c_str());
}

}  // namespace mono_pose_tracker
