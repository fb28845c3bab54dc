#pragma once

#include <nodelet/loader.h>
#include <ros/ros.h>

#include <string>

#include "common/begin_process.h"

namespace mono_pose_tracker {

/// The main of a node that loads one nodelet in its own process. Returns the exit status: 0 after a shutdown,
/// 1 when the nodelet refused, 2 when it could not be loaded.
inline int run_nodelet(const std::string& type, const std::string& default_name, int argc, char** argv) {
  begin_process();
  try {
    ros::init(argc, argv, default_name);  // throws where a name on the command line is none
    nodelet::Loader loader(false);        // no services to load others
    if (!loader.load(ros::this_node::getName(), type, ros::names::getRemappings(),
                     nodelet::V_string(argv + 1, argv + argc))) {
      return 1;  // the loader has said why
    }
    ros::spin();
    return 0;
  } catch (const std::exception& e) {
    ROS_FATAL("%s", e.what());
    return 2;
  }
}

}  // namespace mono_pose_tracker
