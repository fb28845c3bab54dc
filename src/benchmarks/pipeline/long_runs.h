#pragma once

#include <functional>
#include <string>

#include "mono_pose_tracker/tracking/tracker_options.h"
#include "simulation/endless_room.h"
#include "tools/json.h"

namespace mono_pose_tracker {

/// A long live run in a simulated room, or along an endless corridor.
struct SoakOptions {
  bool corridor = false;
  EndlessRoomOptions room;  // or of the corridor; its rate is that of the simulated time
  double minutes = 20;      // simulated
  bool paced = true;        // frames come as time passes; otherwise each when the last is done: none dropped
};

/// Figures of every simulated minute, of the map and the memory at its end, and how the last minute compares
/// with the second (where there are three). Memory is counted from just before the tracker is made.
/// on_minute is called with a line of text: a heading, then each minute as it ends.
Json run_soak(const SoakOptions& options, const TrackerOptions& tracker,
              const std::function<void(const std::string&)>& on_minute);

/// The ratios of the last minute to the second, as text.
std::string soak_ratios(const Json& soak);

/// run_growth_study along a street and before one wall, with the memory that each keyframe takes (resident,
/// of the whole process, features and all).
Json run_growth(int most_keyframes, const TrackerOptions& options);

/// The result as tables for people.
std::string growth_table(const Json& growth);

}  // namespace mono_pose_tracker
