# What most files include, parsed once for all of them. Each still includes what it uses: scripts/lint goes without.
set(precompiled_std <algorithm> <array> <cmath> <cstdint> <functional> <limits> <map> <memory> <optional> <set>
  <sstream> <string> <utility> <vector>)
set(precompiled_core ${precompiled_std} <Eigen/Dense> <opencv2/core.hpp>)
set(precompiled_ros ${precompiled_core} <ros/ros.h> <sensor_msgs/CameraInfo.h> <sensor_msgs/Image.h>)
set(precompiled_test <gtest/gtest.h>)

# ccache finds nothing again of what is compiled with them, unless it is told to be sloppy.
set(precompiled ON)
if(CMAKE_CXX_COMPILER_LAUNCHER MATCHES ccache)
  set(precompiled OFF)
endif()
option(MONO_POSE_TRACKER_PRECOMPILED_HEADERS "parse what most files include once (CMake 3.16)" ${precompiled})

# The target's own, of these headers.
function(tracker_precompile target)
  if(MONO_POSE_TRACKER_PRECOMPILED_HEADERS AND NOT CMAKE_VERSION VERSION_LESS 3.16)
    target_precompile_headers(${target} PRIVATE ${ARGN})
  endif()
endfunction()

# Those of another target that is compiled with the same options.
function(tracker_precompile_as target other)
  if(MONO_POSE_TRACKER_PRECOMPILED_HEADERS AND NOT CMAKE_VERSION VERSION_LESS 3.16)
    target_precompile_headers(${target} REUSE_FROM ${other})
  endif()
endfunction()
