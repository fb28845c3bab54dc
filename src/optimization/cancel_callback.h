#pragma once

#include <ceres/ceres.h>

#include <functional>

namespace mono_pose_tracker {

// Ends a solve when the owner of the options requests it.
class CancelCallback : public ceres::IterationCallback {
 public:
  explicit CancelCallback(const std::function<bool()>& cancel) : cancel_(cancel) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    cancelled_ = cancel_();
    return cancelled_ ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }
  bool cancelled() const { return cancelled_; }

 private:
  const std::function<bool()>& cancel_;
  bool cancelled_ = false;
};

}  // namespace mono_pose_tracker
