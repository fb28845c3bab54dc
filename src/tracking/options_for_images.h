#pragma once

#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

// TrackerOptions::for_images, without the work that a LoadLevel (load_governor.h) skips.
TrackerOptions options_for_images(const TrackerOptions& given, const cv::Size& image, SearchPace pace,
                                  int load_level);

}  // namespace mono_pose_tracker
