// tracker.yaml: what is read must be in range.
#include <stdexcept>

#include "fuzz_target.h"
#include "mono_pose_tracker/tracking/options_table.h"

using namespace mono_pose_tracker;

FUZZ_TARGET(options_yaml) {
  const MemoryFile file(bytes, size);
  TrackerOptions options;
  try {
    read_options_yaml(file.path(), &options);
  } catch (const std::runtime_error& refused) {
    FUZZ_CHECK(is_one_line(refused.what()));
    return;
  }
  try {
    options.validate();
  } catch (const std::invalid_argument& refused) {
    FUZZ_CHECK(is_one_line(refused.what()));  // options that each are in range may exclude each other
  }
}
