#include "bindings.h"

#include <cstring>
#include <opencv2/core/utility.hpp>
#include <stdexcept>

#include "mono_pose_tracker/tracking/options_table.h"

namespace mono_pose_tracker {
namespace {

[[noreturn]] void refuse_argument(const std::string& name, const std::string& found,
                                  const std::string& expected) {
  throw std::invalid_argument(name + " " + found + ": expected " + expected);
}

std::string shape_text(const py::array& array) {
  std::string text = "has the shape (";
  for (py::ssize_t i = 0; i < array.ndim(); ++i) {
    text += (i > 0 ? ", " : "") + std::to_string(array.shape(i));
  }
  return text + ")";
}

/// Keeps the numpy array whose memory a matrix uses.
class ArrayKeeper : public cv::MatAllocator {
 public:
  cv::Mat wrap(py::array array, int rows, int columns, int type) {
    void* const data = const_cast<void*>(array.data());
    cv::Mat image(rows, columns, type, data, static_cast<std::size_t>(array.strides(0)));
    auto* const shared = new cv::UMatData(this);
    shared->data = shared->origdata = static_cast<unsigned char*>(data);
    shared->size = image.step[0] * static_cast<std::size_t>(rows);
    shared->refcount = 1;
    shared->userdata = array.release().ptr();
    image.u = shared;
    image.allocator = this;
    return image;
  }

  cv::UMatData* allocate(int dims, const int* sizes, int type, void* data, std::size_t* step,
                         cv::AccessFlag flags, cv::UMatUsageFlags usage) const override {
    return cv::Mat::getStdAllocator()->allocate(dims, sizes, type, data, step, flags, usage);
  }
  bool allocate(cv::UMatData* shared, cv::AccessFlag flags, cv::UMatUsageFlags usage) const override {
    return cv::Mat::getStdAllocator()->allocate(shared, flags, usage);
  }
  void deallocate(cv::UMatData* shared) const override {
    if (!shared) return;
    const py::gil_scoped_acquire lock;
    py::handle(static_cast<PyObject*>(shared->userdata)).dec_ref();
    delete shared;
  }
};

ArrayKeeper& array_keeper() {
  static auto* const keeper = new ArrayKeeper;  // outlives all matrices
  return *keeper;
}

py::array bytes_array(const py::handle& object, const char* name, bool may_be_bool, const char* expected) {
  if (!py::isinstance<py::array>(object)) {
    refuse_argument(name, "is not a numpy array", expected);
  }
  const auto array = py::reinterpret_borrow<py::array>(object);
  const char kind = array.dtype().kind();
  if (array.itemsize() != 1 || !(kind == 'u' || (may_be_bool && kind == 'b'))) {
    refuse_argument(name, "has the type " + std::string(py::str(array.dtype())), expected);
  }
  return array;
}

cv::Mat wrapped(const py::array& array, int channels) {
  const int rows = static_cast<int>(array.shape(0)), columns = static_cast<int>(array.shape(1));
  const bool rows_are_contiguous = array.strides(1) == channels && (channels == 1 || array.strides(2) == 1) &&
                                   array.strides(0) > 0 &&
                                   array.strides(0) >= static_cast<py::ssize_t>(columns) * channels;
  if (rows_are_contiguous) return array_keeper().wrap(array, rows, columns, CV_8UC(channels));
  const auto copy = py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast>::ensure(array);
  return array_keeper().wrap(copy, rows, columns, CV_8UC(channels));
}

std::string text_of_value(const py::handle& value) {
  if (py::isinstance<py::bool_>(value)) return value.cast<bool>() ? "true" : "false";
  return py::str(value);
}

void set_from_dict(const py::dict& values, const std::string& group, std::vector<OptionEntry>& table) {
  for (const auto& [name, value] : values) {
    const std::string key = (group.empty() ? "" : group + "/") + std::string(py::str(name));
    if (py::isinstance<py::dict>(value)) {
      set_from_dict(value.cast<py::dict>(), key, table);
      continue;
    }
    OptionEntry* entry = nullptr;
    for (OptionEntry& candidate : table) {
      if (candidate.key == key) entry = &candidate;
    }
    if (!entry) {
      const std::string like = suggestion_for(table, key);
      throw std::invalid_argument("option '" + key + "' is unknown" +
                                  (like.empty() ? "" : ": did you mean " + like + "?"));
    }
    if (!set_option(*entry, text_of_value(value)) || !is_in_range(*entry)) {
      refuse_argument(key, "= " + text_of_value(value), expected_value(*entry));
    }
  }
}

}  // namespace

std::vector<Eigen::Vector3d> rows_of(const DoubleArray& array, const char* name, int count) {
  const std::string n = count < 0 ? "n" : std::to_string(count);
  const bool is_right = array.ndim() == 2 && (array.shape(1) == 2 || array.shape(1) == 3) &&
                        (count < 0 || array.shape(0) == count);
  if (!is_right) refuse_argument(name, shape_text(array), "(" + n + ", 2) or (" + n + ", 3)");
  std::vector<Eigen::Vector3d> rows;
  const auto values = array.unchecked<2>();
  rows.reserve(static_cast<std::size_t>(values.shape(0)));
  for (py::ssize_t i = 0; i < values.shape(0); ++i) {
    rows.emplace_back(values(i, 0), values(i, 1), values.shape(1) == 3 ? values(i, 2) : 1.0);
  }
  return rows;
}

std::vector<Eigen::Vector3d> points_of(const DoubleArray& array, const char* name, int count) {
  if (array.ndim() != 2 || array.shape(1) != 3) {
    refuse_argument(name, shape_text(array), "(" + (count < 0 ? "n" : std::to_string(count)) + ", 3)");
  }
  return rows_of(array, name, count);
}

DoubleArray matrices_of(const std::vector<Rigid3>& poses) {
  DoubleArray array({static_cast<py::ssize_t>(poses.size()), py::ssize_t{4}, py::ssize_t{4}});
  auto values = array.mutable_unchecked<3>();
  for (py::ssize_t i = 0; i < values.shape(0); ++i) {
    const Rigid3& pose = poses[static_cast<std::size_t>(i)];
    const Eigen::Matrix3d rotation = pose.rotation_matrix();
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) values(i, r, c) = rotation(r, c);
      values(i, r, 3) = pose.translation[r];
      values(i, 3, r) = 0;
    }
    values(i, 3, 3) = 1;
  }
  return array;
}

DoubleArray matrix_of(const Rigid3& pose) {
  return matrices_of({pose}).reshape({py::ssize_t{4}, py::ssize_t{4}});
}

cv::Mat image_of(const py::handle& object, const char* name) {
  const char* const expected = "uint8 of shape (height, width) or (height, width, 3), blue first";
  const py::array array = bytes_array(object, name, false, expected);
  const bool is_grey = array.ndim() == 2, is_colour = array.ndim() == 3 && array.shape(2) == 3;
  if ((!is_grey && !is_colour) || array.size() == 0) refuse_argument(name, shape_text(array), expected);
  return wrapped(array, is_grey ? 1 : 3);
}

cv::Mat mask_of(const py::handle& object, const char* name, const cv::Size& size) {
  if (object.is_none()) return {};
  const char* const expected = "uint8 or bool of shape (height, width), 0 = ignore";
  const py::array array = bytes_array(object, name, true, expected);
  if (array.ndim() != 2 || array.size() == 0) refuse_argument(name, shape_text(array), expected);
  if (array.shape(0) != size.height || array.shape(1) != size.width) {
    refuse_argument(
        name, shape_text(array),
        "(" + std::to_string(size.height) + ", " + std::to_string(size.width) + "), the shape of the image");
  }
  return wrapped(array, 1);
}

TrackerOptions options_of(const py::object& options) {
  TrackerOptions result;
  if (options.is_none()) return result;
  if (is_path(options)) {
    read_options_yaml(path_of(options), &result);
    return result;
  }
  if (!py::isinstance<py::dict>(options)) {
    refuse_argument("options", "is not a dict", "a dict of \"group/key\" to values, a path or None");
  }
  std::vector<OptionEntry> table = option_table(&result);
  set_from_dict(options.cast<py::dict>(), "", table);
  return result;
}

bool is_path(const py::handle& object) {
  return py::isinstance<py::str>(object) || py::hasattr(object, "__fspath__");
}

std::string path_of(const py::handle& object) {
  return py::str(py::module_::import("os").attr("fspath")(object));
}

}  // namespace mono_pose_tracker

PYBIND11_MODULE(pymonopose, module) {
  module.doc() =
      "Camera poses and a map from the images of one camera: reconstruct, Tracker, and robust pose "
      "estimators. "
      "Transforms are 4x4 matrices b_from_a that map points of frame a into frame b.";
  cv::setNumThreads(1);
  mono_pose_tracker::bind_camera(module);
  mono_pose_tracker::bind_solvers(module);
  mono_pose_tracker::bind_tracking(module);
  mono_pose_tracker::bind_evaluation(module);
}
