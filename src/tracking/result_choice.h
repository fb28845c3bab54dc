#pragma once

#include "tracking/recording.h"

namespace mono_pose_tracker {

// Images that the first map registers, times the share of the view graph's verified matches that it explains:
// the one score by which results are compared.
double score(const RecordingResult& result);

// Whether the result takes the place of the one before: a confirmed one of an unconfirmed one that has not
// far more images, else the higher score by a margin.
bool is_better(const RecordingResult& result, const RecordingResult& before);

// Nothing disqualifies it but that another object may be the one that is wanted.
bool is_right_of_its_object(const RecordingResult& result);

// An object's map that is in several parts.
bool fell_apart(const RecordingResult& result);

// It holds three quarters as many images at least.
bool is_most_of(const RecordingResult& result, const RecordingResult& before);

}  // namespace mono_pose_tracker
