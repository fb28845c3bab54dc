#pragma once

#include "mono_pose_tracker/tracking/recording.h"

namespace mono_pose_tracker {

// What makes the result of a recording that has a map doubtful, and what to do: one line for each, in its
// warnings.
void warn_of_doubts(RecordingResult* result);

}  // namespace mono_pose_tracker
