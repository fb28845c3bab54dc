#include "ros/wall_clock_updater.h"

#include <ros/console.h>

#include <utility>

#include "ros/guard.h"

namespace mono_pose_tracker {
namespace {

// How late /diagnostics may be.
constexpr double kTimerSeconds = 0.25;

}  // namespace

WallClockUpdater::WallClockUpdater(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle,
                                   const std::string& node, const std::string& hardware_id,
                                   const std::string& task, Fill fill)
    : updater_(handle, private_handle, node) {
  updater_.setHardwareID(hardware_id);
  updater_.add(task, [fill = std::move(fill)](diagnostic_updater::DiagnosticStatusWrapper& s) { fill(s); });
  timer_ = private_handle.createWallTimer(ros::WallDuration(kTimerSeconds),
                                          [this](const ros::WallTimerEvent&) { on_timer(); });
}

void WallClockUpdater::on_timer() {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) return;
  guarded([this] { updater_.force_update(); },
          [](const std::string& text) { ROS_ERROR("/diagnostics: %s", text.c_str()); });
  const std::chrono::duration<double> period(updater_.getPeriod());
  next_ = now + std::chrono::duration_cast<std::chrono::steady_clock::duration>(period);
}

}  // namespace mono_pose_tracker
