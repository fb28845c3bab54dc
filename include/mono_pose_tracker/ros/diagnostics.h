#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <mono_pose_tracker/TrackerStatus.h>

#include <functional>
#include <string>

namespace mono_pose_tracker {

/// What /diagnostics says about the tracker.
struct Health {
  TrackerStatus last;  // the newest status; received == 0: none yet
  double seconds_since_image = 0;
  double frames_per_second = 0;
  std::string input_problem;  // what to do about missing images or calibration; empty: none
};

/// OK while it tracks, WARN while it starts, is paused or has dropped a tenth of its images, ERROR while it
/// is lost or has no input.
void fill_diagnostics(const Health& health, diagnostic_updater::DiagnosticStatusWrapper& status);

}  // namespace mono_pose_tracker
