#include "io/yaml_file.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include "camera/camera_parameters.h"
#include "common/text.h"
#include "io/files.h"
#include "mono_pose_tracker/io/camera_yaml.h"

namespace mono_pose_tracker {
namespace {

[[noreturn]] void fail(int line, const std::string& problem) {
  throw std::runtime_error("line " + std::to_string(line) + " " + problem);
}

std::size_t count_values(const YamlValue& value) {
  std::size_t count = 1;
  for (const YamlValue& item : value.items) count += count_values(item);
  for (const auto& entry : value.entries) count += 1 + count_values(entry.second);
  return count;
}

/// Makes the value out of the parser's events, so that nothing is built that the limits refuse.
class Builder : public YAML::EventHandler {
 public:
  explicit Builder(const YamlLimits& limits) : limits_(limits) {}

  YamlValue take() { return std::move(root_); }

  // A comma behind the first makes yaml-cpp begin one empty document after the other, for ever.
  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ > 2) fail_by_second_document(mark);
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    if (documents_ > 1 && open_.empty()) return;  // a line of dashes at the end
    add(leaf(YamlValue::Kind::kNothing, "", mark), anchor);
  }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                const std::string& text) override {
    add(leaf(YamlValue::Kind::kText, text, mark), anchor);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto found = anchored_.find(anchor);
    if (found == anchored_.end()) fail(mark.line + 1, "has an alias of a value that contains this alias");
    count(count_values(found->second), mark);
    add(found->second, YAML::NullAnchor);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open(YamlValue::Kind::kList, mark, anchor);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open(YamlValue::Kind::kMap, mark, anchor);
  }
  void OnMapEnd() override { close(); }

 private:
  /// A list or map whose end has not come yet.
  struct Open {
    YamlValue value;
    YAML::anchor_t anchor = YAML::NullAnchor;
    std::set<std::string> keys;
    std::string key;  // whose value comes next
    bool has_key = false;
  };

  [[noreturn]] static void fail_by_second_document(const YAML::Mark& mark) {
    fail(mark.line + 1, "starts a second document, which would be ignored");
  }

  YamlValue leaf(YamlValue::Kind kind, const std::string& text, const YAML::Mark& mark) {
    if (documents_ > 1) fail_by_second_document(mark);
    count(1, mark);
    YamlValue value;
    value.kind = kind;
    value.line = mark.line + 1;
    value.text = text;
    return value;
  }

  void open(YamlValue::Kind kind, const YAML::Mark& mark, YAML::anchor_t anchor) {
    if (open_.size() >= limits_.depth) {
      fail(mark.line + 1, "is nested more than " + std::to_string(limits_.depth) + " levels deep");
    }
    Open opened;
    opened.value = leaf(kind, "", mark);
    opened.anchor = anchor;
    open_.push_back(std::move(opened));
  }

  void close() {
    Open closed = std::move(open_.back());
    open_.pop_back();
    add(std::move(closed.value), closed.anchor);
  }

  void add(YamlValue value, YAML::anchor_t anchor) {
    if (anchor != YAML::NullAnchor) anchored_[anchor] = value;
    if (open_.empty()) {
      root_ = std::move(value);
      return;
    }
    Open& parent = open_.back();
    if (parent.value.kind == YamlValue::Kind::kList) {
      parent.value.items.push_back(std::move(value));
    } else if (parent.has_key) {
      parent.value.entries.emplace_back(std::move(parent.key), std::move(value));
      parent.has_key = false;
    } else {
      take_key(value, &parent);
    }
  }

  static void take_key(const YamlValue& value, Open* map) {
    if (value.kind != YamlValue::Kind::kText) fail(value.line, "has a key that is not a text");
    if (!map->keys.insert(value.text).second) {
      fail(value.line, "has the key " + value.text + " a second time");
    }
    map->key = value.text;
    map->has_key = true;
  }

  void count(std::size_t values, const YAML::Mark& mark) {
    values_ += values;
    if (values_ > limits_.values) {
      fail(mark.line + 1,
           "has more than " + std::to_string(limits_.values) + " values when aliases are expanded");
    }
  }

  const YamlLimits limits_;
  YamlValue root_;
  std::vector<Open> open_;
  std::map<YAML::anchor_t, YamlValue> anchored_;
  std::size_t values_ = 0;
  int documents_ = 0;
};

}  // namespace

const YamlValue* YamlValue::find(const std::string& key) const {
  for (const auto& entry : entries) {
    if (entry.first == key) return &entry.second;
  }
  return nullptr;
}

YamlValue parse_yaml(const std::string& content, const std::string& expected, const YamlLimits& limits) {
  Builder builder(limits);
  try {
    std::istringstream stream(content);
    YAML::Parser parser(stream);
    while (parser.HandleNextDocument(builder)) {
    }
  } catch (const YAML::Exception& error) {
    fail(error.mark.line + 1, "is not valid YAML (" + one_line(error.msg) + "): expected " + expected);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(one_line(error.what()) + ": expected " + expected);
  }
  return builder.take();
}

YamlValue read_yaml_file(const std::string& path, const std::string& expected, const YamlLimits& limits) {
  const std::string content = read_text_file(path, expected, limits.bytes);
  try {
    return parse_yaml(content, expected, limits);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

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
  explicit Reader(const std::string& path) : path_(path), root_(read_root(path)) {
    if (root_.kind != YamlValue::Kind::kMap) fail(std::string("holds no keys: expected ") + kExpected);
  }

  template <typename T>
  T value(const std::string& key, const char* expected) const {
    return converted<T>(key, at(key), expected);
  }

  std::vector<double> matrix(const std::string& key) const {
    const YamlValue* data = at(key).find("data");
    if (!data || data->kind != YamlValue::Kind::kList) {
      fail(key + (data ? ": data is not a list" : ": has no data") +
           ": expected rows, cols and a list of data");
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
      fail(key + " is " + (is_text ? "'" + value.text + "'" : "not a single value") + ": expected " +
           expected);
    }
    return result;
  }

  /// camera_calibration writes the same once more in a format of its own.
  static YamlValue read_root(const std::string& path) {
    try {
      return read_yaml_file(path, kExpected);
    } catch (const std::runtime_error& error) {
      const std::string extension = lower_case(std::filesystem::path(path).extension().string());
      if (extension != ".txt" && extension != ".ini") throw;
      throw std::runtime_error(std::string(error.what()) + ", such as ost.yaml in the folder of ost.txt");
    }
  }

  std::string path_;
  YamlValue root_;
};

/// Translates errors of CameraModel, which names its fields, to the keys of the file.
std::string in_terms_of_the_file(const std::string& problem, const std::string& matrix) {
  static const std::map<std::string, std::string> keys = {
      {"width", "image_width"}, {"height", "image_height"}, {"distortion", "distortion_coefficients"}};
  const std::size_t end = problem.find(' ');
  const std::string field = problem.substr(0, end);
  if (field == "fx" || field == "fy" || field == "cx" || field == "cy") return matrix + ": " + problem;
  const auto key = keys.find(field);
  return key == keys.end() ? problem : key->second + problem.substr(end);
}

/// The first three columns of a matrix of three rows.
std::array<double, 9> square_matrix(const Reader& reader, const std::string& key, std::size_t columns) {
  const std::vector<double> m = reader.matrix(key);
  if (m.size() != 3 * columns) {
    reader.fail(key + " has " + std::to_string(m.size()) + " numbers: expected " +
                (columns == 3 ? "9 (fx 0 cx 0 fy cy 0 0 1)" : "12 (fx 0 cx 0 0 fy cy 0 0 0 1 0)"));
  }
  std::array<double, 9> k{};
  for (std::size_t i = 0; i < 9; ++i) k[i] = m[i / 3 * columns + i % 3];
  return k;
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

CameraParameters size_and_distortion(const Reader& reader) {
  CameraParameters p;
  p.width = reader.value<int>("image_width", "a whole number of pixels");
  p.height = reader.value<int>("image_height", "a whole number of pixels");
  p.distortion_model = reader.value<std::string>("distortion_model", "a name");
  p.distortion = reader.matrix("distortion_coefficients");
  return p;
}

void write_matrix(std::ostream& out, const std::string& key, int rows, const std::vector<double>& values) {
  out << key << ":\n  rows: " << rows << "\n  cols: " << values.size() / rows << "\n  data: [";
  for (std::size_t i = 0; i < values.size(); ++i) out << (i ? ", " : "") << shortest(values[i]);
  out << "]\n";
}

}  // namespace

CalibrationFile read_calibration_yaml(const std::string& path, bool rectified) {
  const Reader reader(path);
  CalibrationFile file;
  CameraParameters& p = file.camera;
  p = size_and_distortion(reader);
  file.has_distortion =
      std::any_of(p.distortion.begin(), p.distortion.end(), [](double d) { return d != 0; });
  if (rectified) {
    p.distortion_model.clear();
    p.distortion.clear();
  }
  const std::string key = rectified ? "projection_matrix" : "camera_matrix";
  const std::array<double, 9> k = square_matrix(reader, key, rectified ? 4 : 3);
  try {
    file.note = require_camera_matrix(k, p.height);
  } catch (const std::invalid_argument& error) {
    reader.fail(key + " " + error.what());
  }
  p.fx = k[0];
  p.cx = k[2];
  p.fy = k[4];
  p.cy = k[5];
  try {
    p = CameraModel(p).parameters();
  } catch (const std::invalid_argument& error) {
    reader.fail(in_terms_of_the_file(error.what(), key));
  }
  return file;
}

void require_calibration_keys(const std::string& path) {
  const Reader reader(path);
  size_and_distortion(reader);
  for (const char* key : {"camera_matrix", "rectification_matrix"}) square_matrix(reader, key, 3);
  square_matrix(reader, "projection_matrix", 4);
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
