// The nodelet mono_pose_tracker/TrackerNodelet as a node of its own.

#include <nodelet/loader.h>
#include <ros/ros.h>

int main(int argc, char** argv) {
  ros::init(argc, argv, "tracker");
  nodelet::Loader loader(false);  // no services to load others
  try {
    if (!loader.load(ros::this_node::getName(), "mono_pose_tracker/TrackerNodelet",
                     ros::names::getRemappings(), nodelet::V_string(argv + 1, argv + argc))) {
      return 1;  // the loader has said why
    }
  } catch (const std::exception& e) {
    ROS_FATAL("%s", e.what());
    return 2;
  }
  ros::spin();
  return 0;
}
