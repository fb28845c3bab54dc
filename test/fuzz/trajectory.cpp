// TUM files: what was read can be written and read again.
#include <cmath>
#include <stdexcept>

#include "fuzz_target.h"
#include "mono_pose_tracker/io/trajectory.h"

using namespace mono_pose_tracker;

FUZZ_TARGET(trajectory) {
  const MemoryFile file(bytes, size);
  std::vector<StampedPose> poses;
  try {
    poses = read_tum(file.path());
  } catch (const std::runtime_error& refused) {
    FUZZ_CHECK(is_one_line(refused.what()));
    return;
  }
  for (std::size_t i = 0; i < poses.size(); ++i) {
    FUZZ_CHECK(i == 0 || poses[i - 1].stamp_ns <= poses[i].stamp_ns);
    FUZZ_CHECK(std::abs(poses[i].map_from_camera.rotation.norm() - 1) < 1e-9);
    FUZZ_CHECK(poses[i].map_from_camera.translation.allFinite());
  }
}
