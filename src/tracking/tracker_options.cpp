#include "mono_pose_tracker/tracking/tracker_options.h"

#include <stdexcept>

#include "mono_pose_tracker/tracking/options_table.h"

namespace mono_pose_tracker {

void TrackerOptions::validate() const {
  TrackerOptions copy = *this;
  std::string problems;
  for (const OptionEntry& entry : option_table(&copy)) {
    if (is_in_range(entry)) continue;
    problems += "; " + entry.key + " = " + option_text(entry) + ", expected " + expected_value(entry);
  }
  if (!problems.empty()) throw std::invalid_argument(problems.substr(2));
}

}  // namespace mono_pose_tracker
