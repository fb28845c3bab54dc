#include <opencv2/core/utility.hpp>

#include "bindings.h"

PYBIND11_MODULE(pymonopose, module) {
  module.doc() =
      "Camera poses and a map from the images of one camera: reconstruct, Tracker, and robust pose "
      "estimators. "
      "Transforms are 4x4 matrices b_from_a that map points of frame a into frame b.";
  cv::setNumThreads(1);
  mono_pose_tracker::bind_camera(module);
  mono_pose_tracker::bind_solvers(module);
  mono_pose_tracker::bind_tracking(module);
  mono_pose_tracker::bind_evaluation(module);
}
