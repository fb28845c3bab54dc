// The calibration file of track_sequence.
#include <cmath>
#include <stdexcept>

#include "fuzz_target.h"
#include "mono_pose_tracker/io/camera_yaml.h"

using namespace mono_pose_tracker;

FUZZ_TARGET(camera_yaml) {
  const MemoryFile file(bytes, size);
  try {
    const CameraModel camera(read_camera_yaml(file.path()));
    FUZZ_CHECK(std::abs(camera.bearing({0, 0}).norm() - 1) < 1e-9);
  } catch (const std::runtime_error& refused) {
    FUZZ_CHECK(is_one_line(refused.what()));
  }
}
