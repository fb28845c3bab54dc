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

/// Of each folder some images become keyframes, all in one index, and images between them are looked for.
/// Keyframes of the same folder within 2 s are barred. Brute force matches an image with every other keyframe
/// of its folder: a keyframe is right when 5-point RANSAC finds 20 inliers and the rotation of the truth to 5
/// degrees. Counted are the images that have a right keyframe; found those that have one among the best 5.
/// Synthetic keyframes hold features of the folders' keyframes, mixed and disturbed. Times are CPU times of
/// the thread. Throws std::runtime_error, one line, on a folder that cannot be read.
Json run_place_study(const PlaceStudyOptions& study, const TrackerOptions& options);

/// The result as a table for people.
std::string place_table(const Json& places);

}  // namespace mono_pose_tracker
