#pragma once

#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

// TrackerOptions::for_images, less what a LoadLevel (load_governor.h) leaves out for lack of time.
TrackerOptions options_for_images(const TrackerOptions& given, const cv::Size& image, SearchPace pace,
                                  int load_level);

}  // namespace mono_pose_tracker
