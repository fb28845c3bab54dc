#pragma once

#include <exception>
#include <string>

namespace mono_pose_tracker {

/// Runs a callback's action. What it throws, whatever it is, goes to tell(text) and no further: roscpp lets
/// an exception out of its thread, which ends the process and with it every nodelet of the manager. tell may
/// throw as well (there may be no memory left): then nobody is told.
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
    try_to_tell("an exception of an unknown kind");
  }
}

}  // namespace mono_pose_tracker
