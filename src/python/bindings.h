#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

namespace py = pybind11;

// One function for each part of the module pymonopose.
void bind_camera(py::module_& module);
void bind_solvers(py::module_& module);
void bind_tracking(py::module_& module);
void bind_evaluation(py::module_& module);

using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// The rows of an array of shape (n, 2) as (x, y, 1), or of shape (n, 3). Throws std::invalid_argument that
/// names the argument and the shapes expected, also where n is not `count` (negative: any).
std::vector<Eigen::Vector3d> rows_of(const DoubleArray& array, const char* name, int count = -1);

/// As rows_of, of shape (n, 3) alone.
std::vector<Eigen::Vector3d> points_of(const DoubleArray& array, const char* name, int count = -1);

/// An array of shape (4, 4).
DoubleArray matrix_of(const Rigid3& pose);
/// An array of shape (n, 4, 4).
DoubleArray matrices_of(const std::vector<Rigid3>& poses);

/// An image of type uint8, shape (h, w) or (h, w, 3) (blue first). The matrix shares the array's memory, and
/// keeps the array, where each row is contiguous; otherwise it is a copy. May be released on any thread.
/// Throws std::invalid_argument that names the argument.
cv::Mat image_of(const py::handle& object, const char* name);
/// As image_of, of the image's shape (h, w); bool is allowed, too. None: empty.
cv::Mat mask_of(const py::handle& object, const char* name, const cv::Size& size);

/// Options by a path of a tracker.yaml or a dict of "group/key" (or of groups) to values; None: the defaults.
/// Throws std::invalid_argument on unknown keys and values out of range.
TrackerOptions options_of(const py::object& options);

/// The text of a str or a path, as os.fspath has it.
std::string path_of(const py::handle& object);
bool is_path(const py::handle& object);

}  // namespace mono_pose_tracker
