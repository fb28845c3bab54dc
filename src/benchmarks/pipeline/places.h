#pragma once

#include <string>
#include <vector>

#include "mono_pose_tracker/tracking/tracker_options.h"
#include "tools/json.h"

namespace mono_pose_tracker {

/// How well and how fast the place index finds keyframes.
struct PlaceStudyOptions {
  std::vector<std::string> folders;  // each with images.txt, camera.yaml, groundtruth.txt and maybe masks/
  int keyframes = 3000;              // made up to that number by synthetic ones
  int images_per_folder = 40;        // as keyframes, and as many between them as queries
};

/// Benchmark of place recognition. Some images of each folder become keyframes in one index, and images
/// between them are queries. Keyframes of the same folder within 2 s are excluded. Brute force matches a
/// query with every other keyframe of its folder: a keyframe is correct when 5-point RANSAC finds 20 inliers
/// and the true rotation to 5 degrees. Queries with a correct keyframe are counted, and those with one among
/// the best 5 are found. Synthetic keyframes hold mixed and disturbed features of the real ones. Times are
/// CPU times of the thread. Throws std::runtime_error, one line, on a folder that cannot be read.
Json run_place_study(const PlaceStudyOptions& study, const TrackerOptions& options);

/// The result as a table for people.
std::string place_table(const Json& places);

}  // namespace mono_pose_tracker
