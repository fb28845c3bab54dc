#include "ros/diagnostics.h"

#include <ros/console.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <utility>

#include "common/text.h"
#include "ros/reporting.h"

namespace mono_pose_tracker {

std::optional<MemoryUse> memory_use(const std::string& proc) {
  MemoryUse use;
  std::uint64_t pages = 0;
  std::ifstream(proc + "/self/statm") >> pages >> pages;  // the second is the resident part
  use.resident = pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  std::ifstream machine(proc + "/meminfo");
  for (std::string key, value, unit; machine >> key >> value && std::getline(machine, unit);) {
    constexpr std::uint64_t kKilobyte = 1024;
    if (key == "MemTotal:") use.total = std::strtoull(value.c_str(), nullptr, 10) * kKilobyte;
    if (key == "MemAvailable:") use.available = std::strtoull(value.c_str(), nullptr, 10) * kKilobyte;
  }
  if (use.resident == 0 || use.available == 0 || use.available > use.total) return std::nullopt;
  return use;
}

std::optional<double> KeyframeMemory::bytes_per_keyframe(std::uint64_t resident, std::uint32_t map,
                                                         std::uint32_t keyframes) {
  constexpr std::uint32_t kLeast = 10;
  if (map != map_ || keyframes < first_keyframes_ || first_keyframes_ == 0) {
    map_ = map;
    first_keyframes_ = keyframes;
    first_resident_ = resident;
  }
  if (first_keyframes_ == 0 || keyframes < first_keyframes_ + kLeast) return std::nullopt;
  return static_cast<double>(std::max(resident, first_resident_) - first_resident_) /
         (keyframes - first_keyframes_);
}

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

namespace {

using diagnostic_msgs::DiagnosticStatus;

/// Whether the user must act: the calibration or the input images are wrong, and later images will hardly be
/// better.
bool needs_help(std::uint8_t reason) {
  switch (reason) {
    case TrackerStatus::NO_CAMERA_INFO:
    case TrackerStatus::UNCALIBRATED:
    case TrackerStatus::UNSUPPORTED_ENCODING:
    case TrackerStatus::IMAGE_SIZE_MISMATCH:
    case TrackerStatus::UNREADABLE_IMAGE:
    case TrackerStatus::INTERNAL_ERROR:
      return true;
    default:
      return false;
  }
}

/// The state is not enough: a refused image keeps the state of the previous one.
bool has_pose(const TrackerStatus& status) {
  if (status.state != TrackerStatus::TRACKING) return false;
  switch (status.reason) {
    case TrackerStatus::OK:
    case TrackerStatus::DOUBTFUL_POSE:
    case TrackerStatus::NOT_RIGID:
      return true;
    default:
      return false;
  }
}

// Leaves time to act before 80 %, where a machine begins to swap or to end processes.
constexpr double kMuchMemory = 0.7;

bool may_exhaust_memory(const Health& health) {
  return !health.is_map_limited && health.memory && health.memory->used_share() >= kMuchMemory;
}

double megabytes(double bytes) { return bytes / (1 << 20); }

std::string memory_warning(const Health& health) {
  const std::string each = health.bytes_per_keyframe ? formatted(", about %.2f MB for each keyframe",
                                                                 megabytes(*health.bytes_per_keyframe))
                                                     : "";
  return formatted(
      "%.0f %% of the machine's memory is used and the map grows without limit%s: set "
      "mapping/max_keyframes",
      100 * health.memory->used_share(), each.c_str());
}

void fill_summary(const Health& health, diagnostic_updater::DiagnosticStatusWrapper& status) {
  const TrackerStatus& last = health.last;
  const std::string words =
      last.state_name +
      (last.reason == TrackerStatus::OK ? "" : ": " + last.reason_name + ", " + last.reason_text);
  if (!health.input_problem.empty()) {
    status.summary(DiagnosticStatus::ERROR, health.input_problem);
  } else if (last.frames_received == 0) {
    status.summary(DiagnosticStatus::WARN, "no image yet");
  } else if (needs_help(last.reason)) {
    status.summary(DiagnosticStatus::ERROR, words);
  } else if (!has_pose(last)) {
    status.summary(DiagnosticStatus::WARN, words);
  } else if (10 * health.recent_drops > health.recent_frames) {  // a tenth: seen as jerks
    status.summary(DiagnosticStatus::WARN, words + ", but more than 10 % of the images are dropped");
  } else if (!health.output_problem.empty()) {
    status.summary(DiagnosticStatus::WARN, words + ", but " + health.output_problem);
  } else if (may_exhaust_memory(health)) {
    status.summary(DiagnosticStatus::WARN, words + ", but " + memory_warning(health));
  } else {
    status.summary(DiagnosticStatus::OK, words);
  }
}

}  // namespace

void fill_diagnostics(const Health& health, diagnostic_updater::DiagnosticStatusWrapper& status) {
  fill_summary(health, status);
  const TrackerStatus& last = health.last;
  status.add("state", last.state_name);
  status.add("reason", last.reason_name);
  status.add("epoch", last.epoch);
  status.add("map", last.map_id);
  status.add("corrections", last.corrections);
  status.add("frames received", last.frames_received);
  status.add("frames posed", last.frames_posed);
  status.add("frames dropped", last.frames_dropped);
  status.addf("frame rate (Hz)", "%.1f", health.frames_per_second);
  status.addf("seconds since the last image", "%.1f", health.seconds_since_image);
  status.addf("latency (ms)", "%.1f", last.latency_ms);
  status.add("calibration", health.calibration.empty() ? "none" : health.calibration);
  status.add("rectified", (last.rectified ? "yes: " : "no: ") + last.rectified_reason);
  status.add("output", health.output_problem.empty() ? "all is written" : health.output_problem);
  status.add("inliers", last.inliers);
  status.addf("median parallax (deg)", "%.2f", last.median_parallax_deg);
  status.addf("reprojection rms (px)", "%.2f", last.reprojection_rms_px);
  status.add("keyframes", last.keyframes);
  status.add("landmarks", last.landmarks);
  status.add("worker backlog", last.worker_backlog);
  status.add("load level", static_cast<int>(last.load_level));
  if (health.memory) {
    status.addf("memory (MB)", "%.0f", megabytes(static_cast<double>(health.memory->resident)));
    status.addf("memory of the machine in use (%)", "%.0f", 100 * health.memory->used_share());
  }
  if (health.bytes_per_keyframe)
    status.addf("memory per keyframe (MB)", "%.2f", megabytes(*health.bytes_per_keyframe));
}

}  // namespace mono_pose_tracker
