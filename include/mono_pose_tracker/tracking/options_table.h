#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

/// One option by its name in tracker.yaml and on the parameter server ("group/key"), with its range.
struct OptionEntry {
  /// Of the optional ones, `auto` is the text of none.
  using Value = std::variant<int*, double*, float*, bool*, std::string*, std::uint64_t*, std::optional<int>*,
                             std::optional<float>*>;
  std::string key;
  Value value;
  double min = 0, max = 0;           // of numbers
  std::vector<std::string> choices;  // of strings; none: any text
  /// Whether Tracker::set_options changes it: a map that is there does not rest on it. (Descriptors of other
  /// scales or of another norm would no longer match those in the map; a seed counts from the start.)
  bool changeable = false;
};

/// Every option of the tracker, in the order of config/default.yaml: the only list of their names and ranges.
std::vector<OptionEntry> option_table(TrackerOptions* options);

/// Parses text as the option's type and stores it. False, and nothing stored, when it is no such value.
bool set_option(const OptionEntry& entry, const std::string& text);

std::string option_text(const OptionEntry& entry);     // its value
std::string expected_value(const OptionEntry& entry);  // "a number from 0 to 1", ...
bool is_in_range(const OptionEntry& entry);

/// Copies the changeable options.
void copy_changeable(const TrackerOptions& from, TrackerOptions* to);

/// The known key that is most like an unknown one (fewest letters changed), with or without its group; empty
/// where more than half of the letters are others.
std::string suggestion_for(const std::vector<OptionEntry>& table, const std::string& key);

/// Reads options from YAML (groups as maps, or flat "group/key"). Keys left out keep their values. Throws
/// std::runtime_error, one line that names the file and every key at fault with what was expected.
void read_options_yaml(const std::string& path, TrackerOptions* options);

}  // namespace mono_pose_tracker
