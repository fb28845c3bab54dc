// The list of track_sequence --images. What it names is not opened: it would be files of this machine.
#include <stdexcept>

#include "fuzz_target.h"
#include "io/image_source.h"

using namespace mono_pose_tracker;

FUZZ_TARGET(image_list) {
  const MemoryFile file(bytes, size);
  try {
    FUZZ_CHECK(open_image_list(file.path())->size() > 0);
  } catch (const std::runtime_error& refused) {
    FUZZ_CHECK(is_one_line(refused.what()));
  }
}
