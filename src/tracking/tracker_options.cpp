#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

void TrackerOptions::validate() const { sift.validate(); }

}  // namespace mono_pose_tracker
