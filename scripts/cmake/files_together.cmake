# Files of a folder that are compiled eight at a time: what they include is parsed, and what they instantiate compiled,
# once for all of them. What is theirs alone, in a namespace without a name, must then have names of its own within the
# folder. scripts/lint looks at each file by itself, as does a build with ccache, which would find less again.
set(together ON)
if(CMAKE_CXX_COMPILER_LAUNCHER MATCHES ccache)
  set(together OFF)
endif()
option(MONO_POSE_TRACKER_FILES_TOGETHER "compile the files of a folder several at a time (CMake 3.16)" ${together})

function(tracker_together target)
  if(MONO_POSE_TRACKER_FILES_TOGETHER)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
  endif()
endfunction()
