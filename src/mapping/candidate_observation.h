#pragma once

#include <vector>

#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"
#include "mono_pose_tracker/robust/absolute_pose.h"

namespace mono_pose_tracker {

// A feature of an image, and the landmark that it looks like.
struct CandidateObservation {
  int feature;
  LandmarkId landmark;
  int distance2;
};

// Of the keyframe, by what it may see of the map (paper, step 4b). A flag a sight tells which agree.
AbsolutePoseReport pose_by(const Map& map, const Keyframe& keyframe,
                           const std::vector<CandidateObservation>& observations,
                           const AbsolutePoseOptions& options);

// Whether what another keyframe sees is there as well: as many agree as a resected frame needs, and half of
// all. A look-alike place gives neither.
bool is_same_place(const MapperOptions& options, const AbsolutePoseReport& pose);

}  // namespace mono_pose_tracker
