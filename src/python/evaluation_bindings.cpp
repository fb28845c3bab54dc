#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "bindings.h"
#include "mono_pose_tracker/evaluation/trajectory_error.h"
#include "mono_pose_tracker/io/trajectory.h"

namespace mono_pose_tracker {

namespace {

std::vector<StampedPose> poses_of_arrays(const DoubleArray& stamps, const DoubleArray& matrices,
                                         const std::string& name) {
  if (stamps.ndim() != 1 || matrices.ndim() != 3 || matrices.shape(0) != stamps.shape(0) ||
      matrices.shape(1) != 4 || matrices.shape(2) != 4) {
    throw std::invalid_argument(name + ": expected stamps (n,) and poses (n, 4, 4)");
  }
  const auto seconds = stamps.unchecked<1>();
  const auto values = matrices.unchecked<3>();
  std::vector<StampedPose> poses;
  for (py::ssize_t i = 0; i < seconds.shape(0); ++i) {
    Eigen::Matrix3d rotation;
    Eigen::Vector3d translation;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) rotation(r, c) = values(i, r, c);
      translation[r] = values(i, r, 3);
    }
    if (!rotation.allFinite() || !translation.allFinite() || !(std::abs(seconds(i)) <= 9e9) ||
        (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() > 1e-3) {
      throw std::invalid_argument(name + ": pose " + std::to_string(i) +
                                  " is not a rigid transform, or its stamp is not in seconds");
    }
    poses.push_back({std::llround(seconds(i) * 1e9), Rigid3(rotation, translation)});
  }
  std::stable_sort(poses.begin(), poses.end(),
                   [](const StampedPose& a, const StampedPose& b) { return a.stamp_ns < b.stamp_ns; });
  return poses;
}

/// A trajectory file, a pair (stamps, poses), or what has the attributes stamps and poses.
std::vector<StampedPose> trajectory_of(const py::object& object, const std::string& name) {
  if (is_path(object)) return read_tum(path_of(object));
  if (py::isinstance<py::tuple>(object) && py::len(object) == 2) {
    const auto pair = object.cast<py::tuple>();
    return poses_of_arrays(pair[0].cast<DoubleArray>(), pair[1].cast<DoubleArray>(), name);
  }
  if (py::hasattr(object, "stamps") && py::hasattr(object, "poses")) {
    return poses_of_arrays(object.attr("stamps").cast<DoubleArray>(),
                           object.attr("poses").cast<DoubleArray>(), name);
  }
  throw std::invalid_argument(name + ": expected a path, a pair (stamps, poses) or a Result");
}

py::dict evaluate(const py::object& reference, const py::object& estimate, const std::string& align,
                  double max_difference) {
  if (align != "sim3" && align != "se3") throw std::invalid_argument("align: expected 'sim3' or 'se3'");
  if (!(max_difference >= 0 && max_difference <= 1e6)) {
    throw std::invalid_argument("max_difference: expected 0 to 1e6 s");
  }
  EvaluationOptions options;
  options.alignment = align == "sim3" ? Alignment::kSim3 : Alignment::kSe3;
  options.max_difference_ns = std::llround(max_difference * 1e9);
  const TrajectoryError error = evaluate_trajectory(trajectory_of(reference, "reference"),
                                                    trajectory_of(estimate, "estimate"), options);
  py::dict dict;
  dict["frames_reference"] = error.frames_reference;
  dict["frames_matched"] = error.frames_matched;
  dict["scale"] = error.reference_from_estimate.scale;
  dict["position_rmse"] = error.position_rmse;
  dict["position_median"] = error.position_median;
  dict["position_max"] = error.position_max;
  dict["path_length"] = error.path_length;
  dict["position_rmse_percent"] = error.position_rmse_percent;
  dict["rotation_median_deg"] = error.rotation_median_deg;
  dict["rotation_max_deg"] = error.rotation_max_deg;
  dict["relative_rotation_median_deg"] = error.relative_rotation_median_deg;
  dict["relative_direction_median_deg"] = error.relative_direction_median_deg;
  return dict;
}

}  // namespace

void bind_evaluation(py::module_& module) {
  module.def("evaluate", &evaluate, py::arg("reference"), py::arg("estimate"), py::arg("align") = "sim3",
             py::arg("max_difference") = 0.01,
             "Computes the errors of an estimated trajectory. Returns a dict with keys of the JSON file "
             "of evaluate_trajectory. reference, estimate: a file, a pair (stamps (n,), map_from_camera (n, "
             "4, 4)) or a Result. max_difference: largest difference (s) between the stamps "
             "of matched poses.");
}

}  // namespace mono_pose_tracker
