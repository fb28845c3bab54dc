#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "io/image_source.h"
#include "mono_pose_tracker/evaluation/trajectory_error.h"
#include "mono_pose_tracker/tracking/tracker.h"
#include "simulation/simulated_sequence.h"

namespace mono_pose_tracker {

/// Images (320x240) of a hand-held camera in a textured room, in metres.
struct SimulatedRoom {
  CameraModel camera;
  std::vector<SimulatedFrame> frames;
  std::vector<StampedPose> truth;
};

/// Another seed gives another room.
inline SimulatedRoom simulated_room(int frames, double noise_grey_levels, std::uint64_t seed = 1) {
  SequenceOptions options;
  options.scene = SceneKind::kRoom;
  options.frames = frames;
  options.camera = default_camera(SceneKind::kRoom, 320, 240);
  options.noise_grey_levels = noise_grey_levels;
  options.seed = seed;
  const SimulatedSequence sequence(options);
  SimulatedRoom room{sequence.camera(), {}, sequence.path()};
  for (int i = 0; i < sequence.size(); ++i) room.frames.push_back(sequence.render(i));
  return room;
}

class RoomImages : public ImageSource {
 public:
  explicit RoomImages(const SimulatedRoom& room) : room_(room) {}

  SourceImage next() override {
    SourceImage image;
    if (next_ == room_.frames.size()) return image;
    image.kind = next_ == 3 ? SourceImage::Kind::kSkipped : SourceImage::Kind::kImage;  // one cannot be read
    image.stamp_ns = static_cast<std::int64_t>(next_) * 100'000'000;
    image.name = std::to_string(next_);
    image.image = room_.frames[next_].image;
    image.problem = "image " + image.name + " is broken";
    ++next_;
    return image;
  }

 private:
  const SimulatedRoom& room_;
  std::size_t next_ = 0;
};

// The given images, one each tenth of a second; an empty one is unreadable.
class GivenImages : public ImageSource {
 public:
  explicit GivenImages(const std::vector<cv::Mat>& images) : images_(images) {}

  SourceImage next() override {
    SourceImage image;
    if (next_ == images_.size()) return image;
    image.kind = images_[next_].empty() ? SourceImage::Kind::kSkipped : SourceImage::Kind::kImage;
    image.stamp_ns = static_cast<std::int64_t>(next_) * 100'000'000;
    image.name = std::to_string(next_);
    image.image = images_[next_++];
    return image;
  }

 protected:
  std::size_t next_ = 0;

 private:
  const std::vector<cv::Mat>& images_;
};

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
