// The nodelet mono_pose_tracker/CameraNodelet as a node of its own.

#include "ros/nodelet_node.h"

int main(int argc, char** argv) {
  return mono_pose_tracker::run_nodelet("mono_pose_tracker/CameraNodelet", "camera", argc, argv);
}
