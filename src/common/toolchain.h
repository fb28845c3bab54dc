#pragma once

#include <opencv2/core/version.hpp>

// Before a function: it is compiled twice, for any processor and for those with AVX2 and FMA (or with what is
// named); the loader takes the one that runs. Floating-point results repeat on one machine, not to the last
// bit between machines that differ in that.
//
// The choice is made while the loader still relocates: a sanitizer's own code, called from there, jumps
// through addresses that are not filled in yet and crashes. Those builds get the plain code, as do clang's,
// whose libFuzzer builds are always with a sanitizer.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__) && \
    !defined(__SANITIZE_ADDRESS__)
#define MPT_FUNCTION_CLONES_FOR(...) __attribute__((target_clones(__VA_ARGS__, "default")))
#else
#define MPT_FUNCTION_CLONES_FOR(...)
#endif

#if __GNUC__ >= 12
#define MPT_FUNCTION_CLONES MPT_FUNCTION_CLONES_FOR("arch=x86-64-v3")
#else
#define MPT_FUNCTION_CLONES MPT_FUNCTION_CLONES_FOR("avx2")
#endif

/// Stock Noetic's OpenCV is 4.2 (Ubuntu 20.04). cv::SIFT is in the main modules since 4.4, USAC is there
/// since 4.5. -DMONO_POSE_TRACKER_OLD_LIBRARIES among the compiler's flags builds what older versions get,
/// with newer ones as well.
#define MONO_POSE_TRACKER_OPENCV_SINCE(major, minor) \
  (CV_VERSION_MAJOR > (major) || (CV_VERSION_MAJOR == (major) && CV_VERSION_MINOR >= (minor)))

#if MONO_POSE_TRACKER_OPENCV_SINCE(4, 4) && !defined(MONO_POSE_TRACKER_OLD_LIBRARIES)
#define MONO_POSE_TRACKER_WITH_OPENCV_SIFT
#endif
#if MONO_POSE_TRACKER_OPENCV_SINCE(4, 5) && !defined(MONO_POSE_TRACKER_OLD_LIBRARIES)
#define MONO_POSE_TRACKER_WITH_OPENCV_USAC
#endif
