#pragma once

#include <cstddef>
#include <set>
#include <vector>

#include "mapping/view_graph.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

struct CrossViewOptions {
  std::size_t sampled_landmarks = 40;  // of a keyframe, to estimate its overlap with another
  double min_overlap = 0.4;            // share of these: below, too few matches would be left to confirm
  std::size_t pairs_per_keyframe = 4;  // the most overlapping ones; the rest follows through shared landmarks
  double min_view_cosine = 0.7;        // 45 degrees between the views: SIFT's matches grow few beyond
};

// A landmark that one keyframe observes, and the feature of another keyframe that shows the same point.
struct SharedTrack {
  LandmarkId landmark;
  KeyframeId seen_by;
  KeyframeId keyframe;
  int feature;
};

using KeyframePairs = std::vector<std::pair<KeyframeId, KeyframeId>>;

// Keyframe pairs whose views overlap by their poses, but which share few landmarks. Each keyframe is paired
// with the few that overlap most. The newer keyframe of each pair is newer than `newer_than`.
KeyframePairs overlapping_pairs(const BundleOptions& options, const Map& map, KeyframeId newer_than = -1);

// Merges the tracks of keyframes that view the same place but share few landmarks, because the map drifted
// between their times. The pairs become edges of the view graph, and P3P RANSAC over the verified matches
// with landmarks confirms them. Inliers become observations of one landmark; the poses are left to a
// following bundle adjustment. Returns early once options.bundle is cancelled. Returns the merged tracks in
// the order of merging.
std::vector<SharedTrack> match_across_views(const MapperOptions& options, const KeyframePairs& pairs,
                                            ViewGraph* graph, Map* map);

// Keyframes with at least as many inconsistent as consistent shared tracks in an adjusted map. A track is
// inconsistent where the reprojection error in one of its two keyframes exceeds max_error_px.
std::set<KeyframeId> with_inconsistent_tracks(const std::vector<SharedTrack>& tracks, const Map& map,
                                              double max_error_px);

// Merges the same tracks in a map that has grown since. Tracks whose landmark or keyframe is gone are
// ignored.
void merge_tracks(const std::vector<SharedTrack>& tracks, Map* map);

}  // namespace mono_pose_tracker
