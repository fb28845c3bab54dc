#pragma once

#include <exception>
#include <string>

namespace mono_pose_tracker {

/// Runs the action of a callback and passes any exception to tell(text). Otherwise roscpp would let it leave
/// its thread, which ends the process with all nodelets of the manager. tell may throw as well (out of
/// memory); that exception is ignored.
template <typename Action, typename Tell>
void guarded(const Action& action, const Tell& tell) noexcept {
  const auto try_to_tell = [&tell](const char* what) {
    try {
      tell(std::string(what));
    } catch (...) {
    }
  };
  try {
    action();
  } catch (const std::exception& e) {
    try_to_tell(e.what());
  } catch (...) {
    try_to_tell("unknown exception");
  }
}

}  // namespace mono_pose_tracker
