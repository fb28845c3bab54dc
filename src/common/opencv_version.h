#pragma once

#include <opencv2/core/version.hpp>

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
