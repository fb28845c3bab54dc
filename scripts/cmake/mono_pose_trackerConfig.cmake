# find_package(mono_pose_tracker): the imported target mono_pose_tracker::mono_pose_tracker, which needs no ROS.

# A catkin package that depends on one that depends on this: it wants catkin's variables.
set(of_catkin "${CMAKE_CURRENT_LIST_DIR}/../../../share/mono_pose_tracker/cmake")
if(catkin_FOUND_CATKIN_PROJECT AND EXISTS "${of_catkin}/mono_pose_trackerConfig.cmake")
  set(mono_pose_tracker_DIR "${of_catkin}")
  include("${of_catkin}/mono_pose_trackerConfig.cmake")
  return()
endif()

include(CMakeFindDependencyMacro)
find_dependency(Eigen3)
find_dependency(OpenCV COMPONENTS calib3d core features2d imgcodecs imgproc videoio OPTIONAL_COMPONENTS aruco)
include("${CMAKE_CURRENT_LIST_DIR}/mono_pose_trackerTargets.cmake")
