# What most files include, parsed once for all of them. Each still includes what it uses: scripts/lint goes without.
set(precompiled_std <algorithm> <array> <cmath> <cstdint> <functional> <limits> <map> <memory> <optional> <set>
  <sstream> <string> <utility> <vector>)
set(precompiled_core ${precompiled_std} <Eigen/Dense> <opencv2/core.hpp>)
set(precompiled_ros ${precompiled_core} <ros/ros.h> <sensor_msgs/CameraInfo.h> <sensor_msgs/Image.h>)
set(precompiled_test <gtest/gtest.h>)

# Files of a folder are compiled eight at a time: what they include is parsed, and what they instantiate compiled, once for
# all of them. What is theirs alone, in a namespace without a name, must then have names of its own within the folder.
# scripts/lint looks at each file by itself.

# ccache finds nothing again of what is compiled with precompiled headers, unless it is told to be sloppy, and less of
# what is compiled together.
set(is_first_time ON)
if(CMAKE_CXX_COMPILER_LAUNCHER MATCHES ccache)
  set(is_first_time OFF)
endif()
option(MONO_POSE_TRACKER_PRECOMPILED_HEADERS "parse what most files include once (CMake 3.16)" ${is_first_time})
option(MONO_POSE_TRACKER_FILES_TOGETHER "compile the files of a folder several at a time (CMake 3.16)" ${is_first_time})

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

# The target's files, several at a time.
function(tracker_together target)
  if(MONO_POSE_TRACKER_FILES_TOGETHER)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
  endif()
endfunction()
