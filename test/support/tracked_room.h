#pragma once

#include <gtest/gtest.h>

#include <vector>

#include "mono_pose_tracker/evaluation/trajectory_error.h"
#include "mono_pose_tracker/tracking/tracker.h"
#include "support/simulated_room.h"

namespace mono_pose_tracker {

inline constexpr int kFrames = 25;

/// The room, rendered once.
inline const SimulatedRoom& room() {
  static const SimulatedRoom room = simulated_room(kFrames, 1);
  return room;
}

/// Tracks all frames and waits for the mapper after each one.
inline std::vector<FrameReport> track_all(Tracker* tracker) {
  std::vector<FrameReport> reports;
  for (const SimulatedFrame& frame : room().frames) {
    reports.push_back(tracker->process(frame.stamp_ns, frame.image));
    tracker->wait();
  }
  return reports;
}

inline std::vector<StampedPose> registered_poses(const std::vector<FrameReport>& reports) {
  std::vector<StampedPose> poses;
  for (const FrameReport& report : reports) {
    if (report.map_from_camera) poses.push_back({report.stamp_ns, *report.map_from_camera});
  }
  return poses;
}

inline std::vector<StampedPose> registered_poses(const std::vector<RegisteredFrame>& frames) {
  std::vector<StampedPose> poses;
  for (const RegisteredFrame& frame : frames) poses.push_back({frame.stamp_ns, frame.map_from_camera});
  return poses;
}

/// A pixel is 0.22 degrees here, and some hundred features average over it.
inline void expect_accurate(const std::vector<StampedPose>& poses, double rotation_deg,
                            double position_percent) {
  const TrajectoryError error = evaluate_trajectory(room().truth, poses, 0);
  EXPECT_EQ(error.frames_matched, static_cast<int>(poses.size()));
  EXPECT_LT(error.rotation_median_deg, rotation_deg);
  EXPECT_LT(error.position_rmse_percent, position_percent);
}

inline void expect_consistent(const FrameReport& report) {
  EXPECT_EQ(report.reason == Reason::kOk || report.reason == Reason::kDoubtfulPose,
            report.map_from_camera.has_value())
      << to_string(report.reason);
  if (report.map_from_camera) {
    EXPECT_EQ(report.state, State::kTracking);
    EXPECT_GE(report.inliers, 15);
    EXPECT_GT(report.covariance.diagonal().minCoeff(), 0);
    EXPECT_GE(report.keyframes, 3);
  } else {
    EXPECT_FALSE(report.reason_text.empty());
  }
}

}  // namespace mono_pose_tracker
