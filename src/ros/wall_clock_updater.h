#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>

#include <chrono>
#include <functional>
#include <string>

namespace mono_pose_tracker {

/// Publishes /diagnostics at the updater's ~diagnostic_period by the wall clock. The updater's own update()
/// uses ROS time, which stops while a bag is paused and stays behind after a bag has restarted.
class WallClockUpdater {
 public:
  using Fill = std::function<void(diagnostic_updater::DiagnosticStatusWrapper&)>;

  /// task: the status is called NODE: TASK. fill is called by the handles' queue.
  WallClockUpdater(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle,
                   const std::string& node, const std::string& hardware_id, const std::string& task,
                   Fill fill);

 private:
  void on_timer();

  diagnostic_updater::Updater updater_;
  std::chrono::steady_clock::time_point next_;
  ros::WallTimer timer_;
};

}  // namespace mono_pose_tracker
