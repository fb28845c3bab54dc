#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

namespace mono_pose_tracker {

/// Stage names and their times in milliseconds, in the order the stages ran.
using StageTimes = std::vector<std::pair<std::string, double>>;

/// Appends the time between its construction and destruction to a list. Only for reports: no result depends
/// on it.
class StageTimer {
 public:
  StageTimer(StageTimes& times, const char* stage)
      : times_(times), stage_(stage), start_(std::chrono::steady_clock::now()) {}
  ~StageTimer() {
    const std::chrono::duration<double, std::milli> elapsed = std::chrono::steady_clock::now() - start_;
    times_.emplace_back(stage_, elapsed.count());
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  StageTimes& times_;
  const char* stage_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace mono_pose_tracker
