#pragma once

#include <vector>

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"
#include "mono_pose_tracker/robust/absolute_pose.h"

namespace mono_pose_tracker {

// A feature of an image and a landmark with a similar descriptor.
struct CandidateObservation {
  int feature;
  LandmarkId landmark;
  int distance2;
};

// Absolute pose of the keyframe from candidate observations of the map (paper, step 4b). The report has an
// inlier flag for each candidate.
AbsolutePoseReport pose_by(const Map& map, const Keyframe& keyframe,
                           const std::vector<CandidateObservation>& observations,
                           const AbsolutePoseOptions& options);

// Whether the keyframe shows the place of the candidates: at least as many inliers as a registered frame
// needs, and half of all candidates. An aliased place has neither.
bool is_same_place(const MapperOptions& options, const AbsolutePoseReport& pose);

}  // namespace mono_pose_tracker
