#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <mono_pose_tracker/TrackerStatus.h>
#include <ros/node_handle.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace mono_pose_tracker {

/// Memory of this process and of the machine, in bytes.
struct MemoryUse {
  std::uint64_t resident = 0;              // of this process
  std::uint64_t total = 0, available = 0;  // of the machine

  double used_share() const { return 1 - static_cast<double>(available) / static_cast<double>(total); }
};

/// proc: where procfs is mounted. Nothing where it does not give these values.
std::optional<MemoryUse> memory_use(const std::string& proc = "/proc");

/// Estimates how much memory a keyframe takes, from how the process grows with its map. One thread.
class KeyframeMemory {
 public:
  /// Bytes for each keyframe since the beginning of this map; nothing before it has grown by ten.
  std::optional<double> bytes_per_keyframe(std::uint64_t resident, std::uint32_t map,
                                           std::uint32_t keyframes);

 private:
  std::uint32_t map_ = 0;
  std::uint32_t first_keyframes_ = 0;
  std::uint64_t first_resident_ = 0;
};

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

/// Content of /diagnostics for the tracker.
struct Health {
  TrackerStatus last;  // the newest status; received == 0: none yet
  double seconds_since_image = 0;
  double frames_per_second = 0;
  std::string input_problem;   // what to do about missing images or calibration; empty: none
  std::string output_problem;  // a file that cannot be written; empty: none
  std::string calibration;     // size, focal length and where it is from; empty: none
  std::uint32_t recent_frames = 0, recent_drops = 0;  // since /diagnostics last told
  std::optional<MemoryUse> memory;                    // nothing: not known
  std::optional<double> bytes_per_keyframe;           // nothing: not known yet
  bool is_map_limited = false;                        // by mapping/max_keyframes
};

/// OK while it tracks. WARN while it runs without poses (starting, lost, paused), drops 10 % of the images,
/// or cannot write a file: this may pass by itself; also while 70 % of the machine's memory is used and the
/// map has no limit. ERROR if the user must act: no images, unreadable images, no usable calibration.
void fill_diagnostics(const Health& health, diagnostic_updater::DiagnosticStatusWrapper& status);

}  // namespace mono_pose_tracker
