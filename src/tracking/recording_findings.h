#pragma once

#include "tracking/recording.h"

namespace mono_pose_tracker {

// Completes the reports of the result's maps by findings about the whole recording: motions, separate maps,
// images without a pose or with an uncertain one. Every finding becomes a warning.
void add_findings(RecordingResult* result);

}  // namespace mono_pose_tracker
