#pragma once

#include <set>
#include <vector>

#include "candidate_observation.h"
#include "mapping/view_graph.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

// A landmark that one keyframe sees is what this feature of another shows.
struct SharedTrack {
  LandmarkId landmark;
  KeyframeId seen_by;
  KeyframeId keyframe;
  int feature;
};

// Those of what the second may see that agrees, and is of landmarks that the first sees: but what the map has
// it see already. None of nothing that agrees.
std::vector<SharedTrack> shared_tracks_of(const std::vector<CandidateObservation>& candidates,
                                          const std::vector<char>& agrees, const Keyframe& first,
                                          const Keyframe& second);

using KeyframePairs = std::vector<std::pair<KeyframeId, KeyframeId>>;

// Keyframes that would see much of the same by their poses, but share few landmarks: of each the four that
// overlap most. The newer one of each pair is newer than `newer_than`.
KeyframePairs overlapping_pairs(const BundleOptions& options, const Map& map, KeyframeId newer_than = -1);

// Ties keyframes together that look at the same place but share few landmarks, because the map drifted
// between their times: they become edges of the view graph, P3P RANSAC over the verified matches with
// landmarks confirms, and what agrees becomes one landmark. The poses are left to a bundle adjustment that
// follows. One keyframe of each pair is newer than `newer_than`. Ends early once it is cancelled
// (options.bundle). Returns what was tied, in the order of doing it.
std::vector<SharedTrack> match_across_views(const MapperOptions& options, const KeyframePairs& pairs,
                                            ViewGraph* graph, Map* map);

// Keyframes half of whose ties or more do not hold in a map that was adjusted: the landmark is further than
// this from what one of the two shows.
std::set<KeyframeId> with_inconsistent_tracks(const std::vector<SharedTrack>& tracks, const Map& map,
                                              double max_error_px);

// The same ties in a map that has grown since: those whose landmark and keyframe are still there.
void merge_tracks(const std::vector<SharedTrack>& tracks, Map* map);

}  // namespace mono_pose_tracker
