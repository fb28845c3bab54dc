#include "ceres_solver.h"

#include <glog/logging.h>

#include <mutex>

namespace mono_pose_tracker {

void silence_solver_log() {
  static std::once_flag once;
  std::call_once(once, [] {
    if (FLAGS_minloglevel == google::GLOG_INFO) FLAGS_minloglevel = google::GLOG_ERROR;
  });
}

}  // namespace mono_pose_tracker
