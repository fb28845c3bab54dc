#include "mono_pose_tracker/io/camera_yaml.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <stdexcept>

#include "mono_pose_tracker/io/atomic_file.h"
#include "mono_pose_tracker/io/text_file.h"

namespace mono_pose_tracker {
namespace {

/// The file's keys, with errors that say where they are.
class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path) {
    const std::string content = read_text_file(path, "the YAML file that camera_calibration writes");
    try {
      root_ = YAML::Load(content);
    } catch (const YAML::Exception& error) {
      fail("line " + std::to_string(error.mark.line + 1) + " is no YAML (" + error.msg +
           "): expected the file that camera_calibration writes");
    }
    if (!root_.IsMap()) fail("holds no keys: expected the YAML file that camera_calibration writes");
  }

  template <typename T>
  T value(const std::string& key, const char* expected) const {
    return converted<T>(key, node(key), expected);
  }

  std::vector<double> matrix(const std::string& key) const {
    const YAML::Node data = node(key).IsMap() ? node(key)["data"] : YAML::Node();
    if (!data || !data.IsSequence()) {
      fail(key + (data ? ": data is no list" : ": has no data") + ": expected rows, cols and a list of data");
    }
    std::vector<double> values;
    for (const YAML::Node& item : data) values.push_back(converted<double>(key, item, "numbers"));
    return values;
  }

  [[noreturn]] void fail(const std::string& problem) const {
    throw std::runtime_error(path_ + ": " + problem);
  }

 private:
  YAML::Node node(const std::string& key) const {
    const YAML::Node found = root_[key];
    if (!found) fail("has no key " + key + ": expected the YAML file that camera_calibration writes");
    return found;
  }

  template <typename T>
  T converted(const std::string& key, const YAML::Node& node, const char* expected) const {
    try {
      return node.as<T>();
    } catch (const YAML::Exception&) {
      fail(key + " is " + (node.IsScalar() ? "'" + node.Scalar() + "'" : "no single value") + ": expected " +
           expected);
    }
  }

  std::string path_;
  YAML::Node root_;
};

/// CameraModel speaks of its fields; the user of the file knows its keys.
std::string in_terms_of_the_file(const std::string& problem) {
  static const std::map<std::string, std::string> keys = {{"width", "image_width"},
                                                          {"height", "image_height"},
                                                          {"fx", "camera_matrix: fx"},
                                                          {"fy", "camera_matrix: fy"},
                                                          {"cx", "camera_matrix: cx"},
                                                          {"cy", "camera_matrix: cy"},
                                                          {"distortion", "distortion_coefficients"}};
  const std::size_t end = problem.find(' ');
  const auto key = keys.find(problem.substr(0, end));
  return key == keys.end() ? problem : key->second + problem.substr(end);
}

std::string shortest(double value) {
  for (int digits = 15; digits < 17; ++digits) {
    std::ostringstream out;
    out.imbue(std::locale::classic());
    out.precision(digits);
    out << value;
    if (std::stod(out.str()) == value) return out.str();
  }
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(17);
  out << value;
  return out.str();
}

void write_matrix(std::ostream& out, const std::string& key, int rows, const std::vector<double>& values) {
  out << key << ":\n  rows: " << rows << "\n  cols: " << values.size() / rows << "\n  data: [";
  for (std::size_t i = 0; i < values.size(); ++i) out << (i ? ", " : "") << shortest(values[i]);
  out << "]\n";
}

}  // namespace

CameraParameters read_camera_yaml(const std::string& path) {
  const Reader reader(path);
  CameraParameters p;
  p.width = reader.value<int>("image_width", "a whole number of pixels");
  p.height = reader.value<int>("image_height", "a whole number of pixels");
  p.distortion_model = reader.value<std::string>("distortion_model", "a name");
  p.distortion = reader.matrix("distortion_coefficients");
  const std::vector<double> k = reader.matrix("camera_matrix");
  if (k.size() != 9) {
    reader.fail("camera_matrix has " + std::to_string(k.size()) +
                " numbers: expected 9 (fx 0 cx 0 fy cy 0 0 1)");
  }
  if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1) {
    reader.fail("camera_matrix is not of the form fx 0 cx 0 fy cy 0 0 1: expected a camera without skew");
  }
  p.fx = k[0];
  p.cx = k[2];
  p.fy = k[4];
  p.cy = k[5];
  try {
    CameraModel camera(p);
  } catch (const std::invalid_argument& error) {
    reader.fail(in_terms_of_the_file(error.what()));
  }
  return p;
}

void write_camera_yaml(const std::string& path, const std::string& camera_name, const CameraParameters& p) {
  write_file_atomically(path, [&](std::ostream& out) {
    out << "image_width: " << p.width << "\nimage_height: " << p.height << "\ncamera_name: " << camera_name
        << '\n';
    write_matrix(out, "camera_matrix", 3, {p.fx, 0, p.cx, 0, p.fy, p.cy, 0, 0, 1});
    out << "distortion_model: " << (p.distortion_model.empty() ? "plumb_bob" : p.distortion_model) << '\n';
    write_matrix(out, "distortion_coefficients", 1,
                 p.distortion.empty() ? std::vector<double>(5, 0.0) : p.distortion);
    write_matrix(out, "rectification_matrix", 3, {1, 0, 0, 0, 1, 0, 0, 0, 1});
    write_matrix(out, "projection_matrix", 3, {p.fx, 0, p.cx, 0, 0, p.fy, p.cy, 0, 0, 0, 1, 0});
  });
}

}  // namespace mono_pose_tracker
