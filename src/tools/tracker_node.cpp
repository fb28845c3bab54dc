// The nodelet mono_pose_tracker/TrackerNodelet as a node of its own.

#include "ros/nodelet_node.h"

int main(int argc, char** argv) {
  return mono_pose_tracker::run_nodelet("mono_pose_tracker/TrackerNodelet", "tracker", argc, argv);
}
