#include "mono_pose_tracker/tracking/options_table.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cstdlib>
#include <iomanip>
#include <limits>
#include <map>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <type_traits>

#include "common/text.h"
#include "features/marker.h"
#include "io/yaml_file.h"

namespace mono_pose_tracker {

namespace {

constexpr double kUnbounded = 1e12;
constexpr bool kChangeable = true;

// Length limit of the message, in characters: enough for every key of an options file, not for a file of
// another kind.
constexpr std::size_t kMaxProblems = 4000;

bool parse(const std::string& text, bool* value) {
  try {
    *value = YAML::Node(text).as<bool>();
    return true;
  } catch (const YAML::Exception&) {
    return false;
  }
}

template <typename T>
bool parse(const std::string& text, T* value) {
  return parse_decimal(text, value);
}

// Whether ROS's YAML would read the number as octal: 64 for 100.
bool has_leading_zero(const std::string& text) {
  return text.size() > 1 && text[0] == '0' && text[1] >= '0' && text[1] <= '9';
}

constexpr const char* kAuto = "auto";

template <typename T>
struct IsOptional : std::false_type {};
template <typename T>
struct IsOptional<std::optional<T>> : std::true_type {};

template <typename T>
bool parse(const std::string& text, std::optional<T>* value) {
  if (text == kAuto) {
    value->reset();
    return true;
  }
  T number;
  if (!parse(text, &number)) return false;
  *value = number;
  return true;
}

// The shortest text (at least six digits) that reads back as the same value: 0.999999999 is not 1.
template <typename T>
std::string number_text(T value) {
  constexpr int kFewest = 6;
  std::string text;
  for (int digits = kFewest; digits <= std::numeric_limits<T>::max_digits10; ++digits) {
    std::ostringstream stream;
    stream << std::setprecision(digits) << value;
    text = stream.str();
    if (static_cast<T>(std::strtod(text.c_str(), nullptr)) == value) break;
  }
  return text;
}

// Whether keys of the table have this prefix: a group with all values commented out is valid.
bool is_group(const std::vector<OptionEntry>& table, const std::string& key) {
  return std::any_of(table.begin(), table.end(),
                     [&](const OptionEntry& entry) { return entry.key.rfind(key + "/", 0) == 0; });
}

// Collects the values by their full keys, and those that cannot be the value of an option.
void collect_leaves(const YamlValue& map, const std::string& prefix,
                    std::map<std::string, std::string>* leaves, std::string* problems) {
  for (const auto& [name, value] : map.entries) {
    const std::string key = prefix + name;
    if (value.kind == YamlValue::Kind::kMap) {
      collect_leaves(value, key + "/", leaves, problems);
    } else if (value.kind == YamlValue::Kind::kList) {
      *problems += "; " + key + " is a list, expected one value";
    } else if (!leaves->emplace(key, value.text).second) {
      *problems += "; " + key + " is given a second time in line " + std::to_string(value.line);
    }
  }
}

int edit_distance(const std::string& a, const std::string& b) {
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    int diagonal = row[0];
    row[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const int changed = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({changed, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

// Without the aruco module the default must still be in range.
std::vector<std::string> known_dictionaries() {
  return marker_dictionaries().empty() ? std::vector<std::string>{ScaleOptions().marker_dictionary}
                                       : marker_dictionaries();
}

}  // namespace

std::vector<OptionEntry> option_table(TrackerOptions* o) {
  return {
      {"seed", &o->seed, 0, kUnbounded, {}},
      {"inlier_threshold_px", &o->inlier_threshold_px, 0.1, 50, {}, kChangeable},
      {"confidence", &o->confidence, 0.5, 0.999999999, {}},
      {"max_iterations", &o->max_iterations, 10, 1e6, {}, kChangeable},
      {"young_map_keyframes", &o->young_map_keyframes, 0, 1000, {}, kChangeable},
      {"young_map_patience", &o->young_map_patience, 1, 1e6, {}, kChangeable},
      {"localize_only", &o->localize_only, 0, 1, {}, kChangeable},
      {"sift/implementation", &o->sift.implementation, 0, 0, {"own", "opencv"}},
      {"sift/first_octave", &o->sift.first_octave, kFinestOctave, kCoarsestOctave, {}},
      {"sift/max_features", &o->sift.max_features, 0, SiftOptions::kMostFeatures, {}, kChangeable},
      {"sift/contrast_threshold", &o->sift.contrast_threshold, 0, 1, {}, kChangeable},
      {"sift/edge_threshold", &o->sift.edge_threshold, 1, 1000, {}, kChangeable},
      {"sift/octave_layers", &o->sift.octave_layers, 1, 10, {}},
      {"sift/sigma", &o->sift.sigma, 0.6, 10, {}},
      {"sift/root_sift", &o->sift.root_sift, 0, 1, {}},
      {"sift/min_features", &o->sift.min_features, 0, SiftOptions::kMostFeatures, {}, kChangeable},
      {"sift/num_threads", &o->sift.num_threads, 0, 64, {}, kChangeable},
      {"matching/min_ratio", &o->matching.min_ratio, 1, 10, {}, kChangeable},
      {"matching/mutual", &o->matching.mutual, 0, 1, {}},
      {"bootstrap/min_features", &o->bootstrap.min_features, 8, 1e6, {}, kChangeable},
      {"bootstrap/min_matches", &o->bootstrap.min_matches, 8, 1e6, {}, kChangeable},
      {"bootstrap/min_landmarks", &o->bootstrap.min_landmarks, 6, 1e6, {}, kChangeable},
      {"bootstrap/min_parallax_deg", &o->bootstrap.min_parallax_deg, 0, 90, {}, kChangeable},
      {"bootstrap/min_parallax_px", &o->bootstrap.min_parallax_px, 0, 1000, {}, kChangeable},
      {"bootstrap/max_rotation_only", &o->bootstrap.max_rotation_only, 0, 1, {}},
      {"bootstrap/min_confirmed", &o->bootstrap.min_confirmed, 0, 1, {}, kChangeable},
      {"bootstrap/min_evidence", &o->bootstrap.min_evidence, 0, 100, {}, kChangeable},
      {"bootstrap/max_frames", &o->bootstrap.max_frames, 3, 1000, {}},
      {"resection/search_radius", &o->resection.search_radius, 0.001, 1, {}, kChangeable},
      {"resection/refine_radius_px", &o->resection.refine_radius_px, 0.5, 1000, {}},
      {"resection/min_inliers", &o->resection.min_inliers, 6, 1e6, {}, kChangeable},
      {"resection/min_inlier_ratio", &o->resection.min_inlier_ratio, 0, 1, {}, kChangeable},
      {"resection/max_local_keyframes", &o->resection.max_local_keyframes, 1, 1e6, {}, kChangeable},
      {"resection/relocalization_keyframes", &o->resection.relocalization_keyframes, 1, 1e6, {}, kChangeable},
      {"mapping/keyframe_overlap", &o->mapping.keyframe_overlap, 0, 1, {}, kChangeable},
      {"mapping/keyframe_parallax_deg", &o->mapping.keyframe_parallax_deg, 0, 90, {}, kChangeable},
      {"mapping/keyframe_found", &o->mapping.keyframe_found, 0, 1, {}, kChangeable},
      {"mapping/matching_keyframes", &o->mapping.matching_keyframes, 1, 1000, {}, kChangeable},
      {"mapping/window_keyframes", &o->mapping.window_keyframes, 2, 1000, {}, kChangeable},
      {"mapping/window_landmarks", &o->mapping.window_landmarks, 50, 1e6, {}},
      {"mapping/min_parallax_deg", &o->mapping.min_parallax_deg, 0, 90, {}, kChangeable},
      {"mapping/max_reprojection_px", &o->mapping.max_reprojection_px, 0.1, 100, {}, kChangeable},
      {"mapping/max_descriptor_distance", &o->mapping.max_descriptor_distance, 0.05, 1.5, {}},
      {"mapping/redundant_overlap", &o->mapping.redundant_overlap, 0, 1.01, {}, kChangeable},
      {"mapping/max_keyframes", &o->mapping.max_keyframes, 0, 1e6, {}, kChangeable},
      {"mapping/bundle_seconds", &o->mapping.bundle_seconds, 0.001, kUnbounded, {}, kChangeable},
      {"segmentation/method",
       &o->segmentation.method,
       0,
       0,
       {"auto", "none", "mask", "background", "threshold", "chroma", "motion"}},
      {"segmentation/body", &o->segmentation.body, 0, 0, {"largest", "turning"}},
      {"segmentation/background_image", &o->segmentation.background_image, 0, 0, {}},
      {"segmentation/learning_frames", &o->segmentation.learning_frames, 1, 1e6, {}},
      {"segmentation/background_sigmas", &o->segmentation.background_sigmas, 1, 100, {}},
      {"segmentation/background_min_difference", &o->segmentation.background_min_difference, 0, 255, {}},
      {"segmentation/shadow", &o->segmentation.shadow, 0, 1, {}},
      {"segmentation/update_rate", &o->segmentation.update_rate, 0, 1, {}},
      {"segmentation/backdrop", &o->segmentation.backdrop, 0, 0, {"auto", "dark", "bright"}},
      {"segmentation/level", &o->segmentation.level, -1, 255, {}},
      {"segmentation/chroma_color", &o->segmentation.chroma_color, 0, 0, {"green", "blue"}},
      {"segmentation/objects", &o->segmentation.objects, 1, 1000, {}},
      {"segmentation/min_area", &o->segmentation.min_area, 0, 1, {}},
      {"segmentation/margin_px", &o->segmentation.margin_px, 0, 1000, {}},
      {"segmentation/margin_scales", &o->segmentation.margin_scales, 0, 20, {}},
      {"bundle/max_iterations", &o->bundle.max_iterations, 1, 10000, {}, kChangeable},
      {"bundle/loss_width", &o->bundle.loss_width, 0, 1000, {}},
      {"bundle/function_tolerance", &o->bundle.function_tolerance, 0, 1, {}},
      {"bundle/num_threads", &o->bundle.num_threads, 1, 64, {}},
      {"scale/known_baseline", &o->scale.known_baseline, 0, 1e6, {}},
      {"scale/initial_median_depth", &o->scale.initial_median_depth, 0, 1e6, {}},
      {"scale/marker_size", &o->scale.marker_size, 0, marker_dictionaries().empty() ? 0 : 1e3, {}},
      {"scale/marker_dictionary", &o->scale.marker_dictionary, 0, 0, known_dictionaries()},
      {"scale/marker_id", &o->scale.marker_id, 0, 10000, {}},
      {"scale/odometry", &o->scale.odometry, 0, 1, {}},
  };
}

void copy_changeable(const TrackerOptions& from, TrackerOptions* to) {
  TrackerOptions source = from;
  const std::vector<OptionEntry> sources = option_table(&source), targets = option_table(to);
  for (std::size_t i = 0; i < targets.size(); ++i) {
    if (!targets[i].changeable) continue;
    std::visit([&](auto* target) { *target = *std::get<decltype(target)>(sources[i].value); },
               targets[i].value);
  }
}

bool set_option(const OptionEntry& entry, const std::string& text) {
  return std::visit(
      [&](auto* target) {
        using T = std::remove_pointer_t<decltype(target)>;
        if constexpr (std::is_same_v<T, std::string>) {
          *target = text;
          return true;
        } else {
          T value;
          if (!parse(text, &value)) return false;
          *target = value;
          return true;
        }
      },
      entry.value);
}

namespace {

std::string value_text(const std::string& value) { return value; }

template <typename T>
std::string value_text(const T& value) {
  if constexpr (IsOptional<T>::value) {
    return value ? value_text(*value) : kAuto;
  } else if constexpr (std::is_same_v<T, bool>) {
    return value ? "true" : "false";
  } else if constexpr (std::is_integral_v<T>) {
    return std::to_string(value);
  } else {
    return number_text(value);
  }
}

template <typename T>
bool is_allowed(const T& value, const OptionEntry& entry) {
  if constexpr (std::is_same_v<T, std::string>) {
    return entry.choices.empty() ||
           std::find(entry.choices.begin(), entry.choices.end(), value) != entry.choices.end();
  } else if constexpr (IsOptional<T>::value) {
    return !value || is_allowed(*value, entry);
  } else if constexpr (std::is_same_v<T, bool> || std::is_same_v<T, std::uint64_t>) {
    return true;
  } else {
    // The bounds in the option's own type.
    return value >= static_cast<T>(entry.min) &&
           (entry.max >= static_cast<double>(std::numeric_limits<T>::max()) ||
            value <= static_cast<T>(entry.max));
  }
}

template <typename T>
bool holds(const OptionEntry& entry) {
  return std::holds_alternative<T*>(entry.value);
}

}  // namespace

std::string option_text(const OptionEntry& entry) {
  return std::visit([](auto* value) { return value_text(*value); }, entry.value);
}

std::string expected_value(const OptionEntry& entry) {
  if (holds<bool>(entry)) return "true or false";
  if (holds<std::string>(entry)) {
    if (entry.choices.empty()) return "a text";
    std::string text = "one of";
    for (const std::string& choice : entry.choices) text += " " + choice;
    return text;
  }
  const bool may_be_auto = holds<std::optional<int>>(entry) || holds<std::optional<float>>(entry);
  const bool whole = holds<int>(entry) || holds<std::uint64_t>(entry) || holds<std::optional<int>>(entry);
  const std::string kind =
      std::string(may_be_auto ? "auto or " : "") + (whole ? "a whole number" : "a number");
  if (entry.max >= kUnbounded) return kind + " of at least " + number_text(entry.min);
  return kind + " from " + number_text(entry.min) + " to " + number_text(entry.max);
}

bool is_in_range(const OptionEntry& entry) {
  return std::visit([&](auto* value) { return is_allowed(*value, entry); }, entry.value);
}

std::string suggestion_for(const std::vector<OptionEntry>& table, const std::string& key) {
  const auto letters_changed = [&](const std::string& known) {
    return std::min(edit_distance(key, known), edit_distance(key, known.substr(known.rfind('/') + 1)));
  };
  const auto nearest =
      std::min_element(table.begin(), table.end(), [&](const OptionEntry& a, const OptionEntry& b) {
        return letters_changed(a.key) < letters_changed(b.key);
      });
  if (nearest == table.end() || 2 * letters_changed(nearest->key) > static_cast<int>(key.size())) return "";
  return nearest->key;
}

void read_options_yaml(const std::string& path, TrackerOptions* options) {
  const YamlValue root = read_yaml_file(path, "options of the tracker, see config/default.yaml");
  if (root.kind != YamlValue::Kind::kMap && root.kind != YamlValue::Kind::kNothing) {
    throw std::runtime_error(path + ": expected a map of options");
  }
  std::map<std::string, std::string> leaves;
  std::string problems;
  collect_leaves(root, "", &leaves, &problems);
  const std::vector<OptionEntry> table = option_table(options);
  for (const auto& leaf : leaves) {
    const std::string &key = leaf.first, &text = leaf.second;  // clang captures no structured binding
    if (problems.size() > kMaxProblems) {
      problems += "; ...";
      break;
    }
    const auto entry =
        std::find_if(table.begin(), table.end(), [&](const OptionEntry& e) { return e.key == key; });
    if (entry == table.end() && text.empty() && is_group(table, key)) continue;
    if (entry == table.end()) {
      const std::string meant = suggestion_for(table, key);
      problems += "; unknown key " + key + (meant.empty() ? "" : ", did you mean " + meant + "?");
    } else if (!set_option(*entry, text) || !is_in_range(*entry)) {
      problems += "; " + key + " = " + text + ", expected " + expected_value(*entry);
      if (has_leading_zero(text)) problems += ", without leading zeros";
    }
  }
  if (!problems.empty()) throw std::runtime_error(path + ": " + one_line(problems.substr(2)));
}

}  // namespace mono_pose_tracker
