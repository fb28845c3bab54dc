#include "mono_pose_tracker/ros/trajectory_log.h"

#include <cinttypes>
#include <cstdio>
#include <stdexcept>

namespace mono_pose_tracker {
namespace {

std::string tum_line(std::int64_t stamp_ns, const Rigid3& map_from_camera) {
  const Eigen::Vector3d& t = map_from_camera.translation;
  const Eigen::Quaterniond& q = map_from_camera.rotation;
  char line[256];
  std::snprintf(line, sizeof(line), "%" PRId64 ".%09" PRId64 " %.9g %.9g %.9g %.9g %.9g %.9g %.9g\n",
                stamp_ns / 1000000000, stamp_ns % 1000000000, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(),
                q.w());
  return line;
}

void open(const std::string& path, std::ofstream& file) {
  file.open(path, std::ios::trunc);
  if (!file) throw std::runtime_error(path + ": cannot be written");
  file << "# timestamp tx ty tz qx qy qz qw (map_from_camera)\n" << std::flush;
}

}  // namespace

TrajectoryLog::TrajectoryLog(const std::string& path) : path_(path) { open(path, file_); }

void TrajectoryLog::append(const FrameReport& report) {
  if (!report.map_from_camera) return;
  if (!empty_ && report.epoch != epoch_) {
    file_ << "# a new map begins (epoch " << report.epoch << "): another origin and scale\n";
  }
  empty_ = false;
  epoch_ = report.epoch;
  file_ << tum_line(report.stamp_ns, *report.map_from_camera) << std::flush;
  if (!file_) throw std::runtime_error(path_ + ": writing failed");
}

void write_tum_trajectory(const std::string& path, const std::vector<KeyframePose>& poses) {
  std::ofstream file;
  open(path, file);
  for (const KeyframePose& pose : poses) file << tum_line(pose.stamp_ns, pose.map_from_camera);
  if (!file.flush()) throw std::runtime_error(path + ": writing failed");
}

}  // namespace mono_pose_tracker
