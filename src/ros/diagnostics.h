#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <mono_pose_tracker/TrackerStatus.h>

#include <cstdint>
#include <optional>
#include <string>

#include "ros/memory_use.h"

namespace mono_pose_tracker {

/// Content of /diagnostics for the tracker.
struct Health {
  TrackerStatus last;  // the newest status; received == 0: none yet
  double seconds_since_image = 0;
  double frames_per_second = 0;
  std::string input_problem;   // what to do about missing images or calibration; empty: none
  std::string output_problem;  // a file that cannot be written; empty: none
  std::string calibration;     // size, focal length and where it is from; empty: none
  std::uint32_t recent_frames = 0, recent_drops = 0;  // since /diagnostics last told
  std::optional<MemoryUse> memory;                    // nothing: not known
  std::optional<double> bytes_per_keyframe;           // nothing: not known yet
  bool is_map_limited = false;                        // by mapping/max_keyframes
};

/// OK while it tracks. WARN while it runs without poses (starting, lost, paused), drops 10 % of the images,
/// or cannot write a file: this may pass by itself; also while 70 % of the machine's memory is used and the
/// map has no limit. ERROR if the user must act: no images, unreadable images, no usable calibration.
void fill_diagnostics(const Health& health, diagnostic_updater::DiagnosticStatusWrapper& status);

}  // namespace mono_pose_tracker
