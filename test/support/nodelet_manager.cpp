// `nodelet manager` for sanitizer builds: that program is not instrumented and cannot load libraries that
// are.
#include <nodelet/loader.h>
#include <ros/ros.h>

int main(int argc, char** argv) {
  ros::init(argc, argv, "manager");
  nodelet::Loader loader;  // offers the services by which nodelets are loaded
  ros::spin();
}
