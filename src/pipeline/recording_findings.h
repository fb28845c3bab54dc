#pragma once

#include <cstddef>

#include "doubtful_frames.h"
#include "pipeline/recording.h"

namespace mono_pose_tracker {

struct RecordingFindingsOptions {
  // Images of a map other than the first; one with fewer is not confirmed. The reason for its separation is
  // unknown, and inconsistencies hardly show in so few images: maps of ten to sixteen images without any
  // finding were 5 to 9 % off; none of twenty or more was.
  std::size_t least_outside_first = 20;
  double most_unregistered = 0.1;  // share of the images: fewer are usual, as every recording has some
                                   // blurred images
  std::size_t listed_images = 10;  // in a message
  DoubtfulFramesOptions doubtful;
};

// Completes the reports of the result's maps by findings about the whole recording: motions, separate maps,
// images without a pose or with an uncertain one. Every finding becomes a warning.
void add_findings(RecordingResult* result, const RecordingFindingsOptions& options = {});

}  // namespace mono_pose_tracker
