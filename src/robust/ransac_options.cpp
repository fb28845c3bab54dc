#include "mono_pose_tracker/robust/ransac_options.h"

#include <stdexcept>
#include <string>

namespace mono_pose_tracker {

namespace {

void require(bool in_range, const char* option, double value, const char* range) {
  if (!in_range) {
    throw std::invalid_argument(std::string("RansacOptions: ") + option + " is " + std::to_string(value) +
                                ", expected " + range);
  }
}

}  // namespace

void RansacOptions::validate() const {
  require(threshold > 0 && threshold <= 0.5, "threshold", threshold, "in (0, 0.5]");
  require(confidence > 0 && confidence < 1, "confidence", confidence, "in (0, 1)");
  require(min_iterations >= 0, "min_iterations", min_iterations, "at least 0");
  require(max_iterations >= 1 && max_iterations >= min_iterations, "max_iterations", max_iterations,
          "at least 1 and at least min_iterations");
}

}  // namespace mono_pose_tracker
