#include "ros/trajectory_log.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>

#include "common/text.h"
#include "io/files.h"
#include "mono_pose_tracker/io/trajectory.h"

namespace mono_pose_tracker {
namespace {

const char* const kHead = "# timestamp tx ty tz qx qy qz qw (map_from_camera)\n";

std::string line_of(std::int64_t stamp_ns, const Rigid3& map_from_camera) {
  return tum_line({stamp_ns, map_from_camera}) + '\n';
}

/// A pipe that nobody reads is refused, one that is full is tried again: nobody waits.
int open_without_waiting(const std::string& path, int flags) {
  return open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_NONBLOCK | O_CLOEXEC | flags, 0666);
}

}  // namespace

TrajectoryLog::TrajectoryLog(const std::string& path) : path_(path) {
  file_ = open_without_waiting(path, O_TRUNC);
  if (file_ < 0) throw std::runtime_error(path + ": cannot be written (" + system_error_text() + ")");
  waiting_.push_back(kHead);
  write_waiting();
}

TrajectoryLog::~TrajectoryLog() {
  retry();
  close(file_);
}

void TrajectoryLog::append(const FrameReport& report) {
  if (!report.map_from_camera) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  std::string lines = line_of(report.stamp_ns, *report.map_from_camera);
  if (!empty_ && (report.epoch != epoch_ || report.map_id != map_id_)) {  // joined, a map stays in its epoch
    lines = new_map_line("epoch " + std::to_string(report.epoch)) + "\n" + lines;
  }
  empty_ = false;
  epoch_ = report.epoch;
  map_id_ = report.map_id;
  waiting_.push_back(std::move(lines));
  // The first may be half written; the second says how many are lost.
  while (waiting_.size() > kMostWaiting) {
    if (note_ == 1) {
      waiting_.erase(waiting_.begin() + 1);
    } else {
      note_ = 1;
      lost_ = 0;
    }
    ++lost_;
    waiting_[1] = "# " + std::to_string(lost_) + " poses are missing here: they could not be written\n";
  }
  write_waiting();
}

void TrajectoryLog::retry() {
  const std::lock_guard<std::mutex> lock(mutex_);
  write_waiting();
}

std::size_t TrajectoryLog::renewals() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return renewals_;
}

std::string TrajectoryLog::problem() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (waiting_.empty()) return "";
  std::string text = path_ + ": cannot be written (" + reason_ + "); " + std::to_string(waiting_.size()) +
                     " poses are waiting";
  if (lost_ > 0) text += ", " + std::to_string(lost_) + " are lost";
  return text;
}

/// Whether the path still refers to the open file: writes to a removed file are lost without an error. A pipe
/// does not change.
bool TrajectoryLog::is_in_place() const {
  struct stat open = {}, found = {};
  if (fstat(file_, &open) != 0 || !S_ISREG(open.st_mode)) return true;
  return stat(path_.c_str(), &found) == 0 && found.st_dev == open.st_dev && found.st_ino == open.st_ino;
}

/// False, with the reason, if the file cannot be opened. An existing file may belong to somebody else: lines
/// are appended.
bool TrajectoryLog::renew() {
  const int file = open_without_waiting(path_, 0);
  if (file < 0) {
    reason_ = system_error_text();
    return false;
  }
  close(file_);
  file_ = file;
  ++renewals_;
  struct stat found = {};
  const bool is_new = fstat(file_, &found) == 0 && found.st_size == 0;
  // To the first line, not before it: note_ counts them.
  if (is_new && waiting_.front().rfind(kHead, 0) != 0) waiting_.front().insert(0, kHead);
  return true;
}

void TrajectoryLog::write_waiting() {
  if (waiting_.empty() || (!is_in_place() && !renew())) return;
  while (!waiting_.empty() && write_first()) {
    waiting_.pop_front();
    if (note_ >= 0 && --note_ < 0) lost_ = 0;
  }
}

/// False, with the reason, if the line cannot be written completely; the file is then unchanged.
bool TrajectoryLog::write_first() {
  std::string& line = waiting_.front();
  struct stat before = {};
  const bool known = fstat(file_, &before) == 0 && S_ISREG(before.st_mode);
  std::size_t written = 0;
  while (written < line.size()) {
    const ssize_t count = write(file_, line.data() + written, line.size() - written);
    if (count > 0) {
      written += static_cast<std::size_t>(count);
    } else if (count == 0 || errno != EINTR) {
      reason_ = count == 0 ? "no bytes were accepted" : system_error_text();
      // A pipe gives nothing back: it gets the rest of the line.
      if (written > 0 && !(known && ftruncate(file_, before.st_size) == 0)) line.erase(0, written);
      return false;
    }
  }
  return true;
}

void write_tum_trajectory(const std::string& path, const std::vector<KeyframePose>& poses) {
  require_regular_file(path);
  // What the file has is worth more than a head without a pose.
  if (poses.empty()) throw std::runtime_error("there is no pose yet");
  write_file_atomically(path, [&](std::ostream& out) {
    out << kHead;
    for (const KeyframePose& pose : poses) out << line_of(pose.stamp_ns, pose.map_from_camera);
  });
}

}  // namespace mono_pose_tracker
