# Builds for those who work on the package: scripts/test asks for them, each in a folder of its own. Users build without.

# A newer compiler may warn of more.
option(MONO_POSE_TRACKER_WARNINGS_AS_ERRORS "stop at a warning" OFF)
set(warnings -Wall -Wextra)
if(MONO_POSE_TRACKER_WARNINGS_AS_ERRORS)
  list(APPEND warnings -Werror)
endif()

option(MONO_POSE_TRACKER_COVERAGE "count which lines run" OFF)
if(MONO_POSE_TRACKER_COVERAGE)
  # Atomic: counters are shared by threads. Not -O3: it moves lines about.
  set(CMAKE_CXX_FLAGS_RELEASE "-O1")
  add_compile_options(--coverage -fprofile-update=atomic)
  add_link_options(--coverage)
endif()

# -O1: reports keep their lines, and an image still takes about a second. Without NDEBUG: the assertions of Eigen and of
# the standard library find what a sanitizer can't see.
set(MONO_POSE_TRACKER_SANITIZE "" CACHE STRING "sanitizers, as -fsanitize takes them: address,undefined or thread")
if(MONO_POSE_TRACKER_SANITIZE)
  set(sanitizers ${MONO_POSE_TRACKER_SANITIZE})
  if(sanitizers MATCHES undefined)
    string(APPEND sanitizers ",float-cast-overflow")
    # A report ends the program: beside AddressSanitizer, gcc's heeds no log_path, so that it would be seen by nobody.
    add_compile_options(-fno-sanitize-recover=undefined,float-cast-overflow)
  endif()
  set(CMAKE_CXX_FLAGS_RELEASE "-O1")
  add_compile_definitions(_GLIBCXX_ASSERTIONS)
  add_compile_options(-fsanitize=${sanitizers} -fno-omit-frame-pointer -g1)
  add_link_options(-fsanitize=${sanitizers})
endif()

option(MONO_POSE_TRACKER_FUZZ "with clang: the fuzz targets of test/fuzz (scripts/fuzz)" OFF)
if(MONO_POSE_TRACKER_FUZZ)
  set(sanitizers address,undefined,float-cast-overflow)
  set(CMAKE_CXX_FLAGS_RELEASE "-O1")
  add_compile_definitions(MONO_POSE_TRACKER_LIBFUZZER _GLIBCXX_ASSERTIONS)
  add_compile_options(-fsanitize=fuzzer-no-link,${sanitizers} -fno-sanitize-recover=all -fno-omit-frame-pointer -g1)
  add_link_options(-fsanitize=${sanitizers})
endif()
