#include "mono_pose_tracker/io/camera_yaml.h"

#include <algorithm>
#include <map>
#include <sstream>
#include <stdexcept>

#include "mono_pose_tracker/camera/camera_matrix.h"
#include "mono_pose_tracker/common/decimal.h"
#include "mono_pose_tracker/common/one_line.h"
#include "mono_pose_tracker/io/atomic_file.h"
#include "mono_pose_tracker/io/yaml_file.h"

namespace mono_pose_tracker {
namespace {

const char* const kExpected = "the YAML file that camera_calibration writes";

bool parse(const std::string& text, std::string* value) {
  *value = text;
  return true;
}
template <typename T>
bool parse(const std::string& text, T* value) {
  return parse_decimal(text, value);
}

/// The file's keys, with errors that say where they are.
class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path), root_(read_yaml_file(path, kExpected)) {
    if (root_.kind != YamlValue::Kind::kMap) fail(std::string("holds no keys: expected ") + kExpected);
  }

  template <typename T>
  T value(const std::string& key, const char* expected) const {
    return converted<T>(key, at(key), expected);
  }

  std::vector<double> matrix(const std::string& key) const {
    const YamlValue* data = at(key).find("data");
    if (!data || data->kind != YamlValue::Kind::kList) {
      fail(key + (data ? ": data is no list" : ": has no data") + ": expected rows, cols and a list of data");
    }
    std::vector<double> values;
    for (const YamlValue& item : data->items) values.push_back(converted<double>(key, item, "numbers"));
    return values;
  }

  [[noreturn]] void fail(const std::string& problem) const {
    throw std::runtime_error(path_ + ": " + one_line(problem));
  }

 private:
  const YamlValue& at(const std::string& key) const {
    const YamlValue* found = root_.find(key);
    if (!found) fail("has no key " + key + ": expected " + kExpected);
    return *found;
  }

  template <typename T>
  T converted(const std::string& key, const YamlValue& value, const char* expected) const {
    const bool is_text = value.kind == YamlValue::Kind::kText;
    T result{};
    if (!is_text || !parse(value.text, &result)) {
      fail(key + " is " + (is_text ? "'" + value.text + "'" : "no single value") + ": expected " + expected);
    }
    return result;
  }

  std::string path_;
  YamlValue root_;
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
  try {
    require_camera_matrix({k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7], k[8]});
  } catch (const std::invalid_argument& error) {
    reader.fail(std::string("camera_matrix ") + error.what());
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
