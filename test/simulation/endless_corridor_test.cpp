#include "simulation/endless_room.h"

#include <gtest/gtest.h>

#include "mono_pose_tracker/evaluation/trajectory_error.h"
#include "mono_pose_tracker/tracking/tracker.h"
#include "simulation/simulated_sequence.h"

namespace mono_pose_tracker {
namespace {

EndlessRoomOptions small_corridor() {
  EndlessRoomOptions options;
  options.camera = default_camera(SceneKind::kRoom, 160, 120);
  options.rate_hz = 5;
  return options;
}

TEST(EndlessCorridor, RepeatsForASeedAndNeverAlongTheWay) {
  const EndlessCorridor corridor(small_corridor()), again(small_corridor());
  const cv::Mat first = corridor.frame(100).image;
  corridor.frame(3);
  EXPECT_EQ(cv::norm(first, corridor.frame(100).image, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(first, again.frame(100).image, cv::NORM_INF), 0);
  for (const std::int64_t later : {740, 1380, 100000}) {  // some of them pieces of the pattern apart
    EXPECT_GT(cv::norm(first, corridor.frame(later).image, cv::NORM_L1) / static_cast<double>(first.total()),
              15)
        << later;
  }
}

// An hour and more from its beginning as well as there.
TEST(EndlessCorridor, IsTrackedAlongItsTrueWay) {
  const EndlessCorridor corridor(small_corridor());
  for (const std::int64_t begin : {0, 20000}) {
    Tracker tracker(TrackerOptions(), CameraModel(small_corridor().camera), Tracker::Mapping::kInline);
    std::vector<StampedPose> truth, registered;
    constexpr int kFrames = 40;
    for (std::int64_t i = begin; i < begin + kFrames; ++i) {
      const EndlessRoom::Frame frame = corridor.frame(i);
      truth.push_back(frame.truth);
      const FrameReport report = tracker.process(frame.truth.stamp_ns, frame.image);
      if (report.map_from_camera) registered.push_back({report.stamp_ns, *report.map_from_camera});
    }
    EXPECT_GT(registered.size(), kFrames - 10u);
    const TrajectoryError error = evaluate_trajectory(truth, registered, 0);
    EXPECT_LT(error.rotation_median_deg, 1.5);
    EXPECT_LT(error.position_rmse_percent, 5)
        << "of the way, which is some eight metres at a pixel of 0.4 deg";
  }
}

}  // namespace
}  // namespace mono_pose_tracker
