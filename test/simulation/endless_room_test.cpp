#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "mono_pose_tracker/evaluation/trajectory_error.h"
#include "mono_pose_tracker/tracking/tracker.h"
#include "simulation/endless_room.h"
#include "simulation/simulated_sequence.h"

namespace mono_pose_tracker {
namespace {

EndlessRoomOptions small_room() {
  EndlessRoomOptions options;
  options.camera = default_camera(SceneKind::kRoom, 160, 120);
  options.lap_frames = 12;
  options.rate_hz = 4;
  options.threads = 2;
  return options;
}

double mean_difference(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_L1) / static_cast<double>(a.total());
}

TEST(EndlessRoom, FramesShowTheRoomFromTheirTruePose) {
  EndlessRoomOptions options = small_room();
  options.noise_grey_levels = 0;
  const EndlessRoom room(options);
  for (const std::int64_t index : {0, 7, 100, 100000}) {
    const EndlessRoom::Frame frame = room.frame(index);
    SequenceOptions direct;
    direct.scene = SceneKind::kRoom;
    direct.camera = options.camera;
    direct.seed = options.seed;
    direct.samples = 1;
    direct.path = {frame.truth};
    cv::Mat truth, shifted;
    cv::cvtColor(SimulatedSequence(direct).render(0).image, truth, cv::COLOR_BGR2GRAY);
    ASSERT_EQ(frame.image.size(), truth.size());
    // Half a pixel beside is told from right, in both directions.
    const double right = mean_difference(frame.image, truth);
    for (const cv::Point2d by :
         {cv::Point2d(0.5, 0), cv::Point2d(-0.5, 0), cv::Point2d(0, 0.5), cv::Point2d(0, -0.5)}) {
      const cv::Mat move = (cv::Mat_<double>(2, 3) << 1, 0, by.x, 0, 1, by.y);
      cv::warpAffine(truth, shifted, move, truth.size(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
      EXPECT_LT(right, mean_difference(frame.image, shifted)) << "frame " << index << " by " << by;
    }
  }
}

TEST(EndlessRoom, FramesDifferThoughPositionsRecur) {
  const EndlessRoom room(small_room());
  const EndlessRoom::Frame first = room.frame(0);
  int recurring = 0;
  for (std::int64_t index = 1; index < 60; ++index) {
    const EndlessRoom::Frame frame = room.frame(index);
    EXPECT_GT(mean_difference(frame.image, first.image), 1);
    EXPECT_EQ(frame.truth.stamp_ns - first.truth.stamp_ns, index * 250'000'000);
    if ((frame.truth.map_from_camera.translation - first.truth.map_from_camera.translation).norm() > 1e-9) {
      continue;
    }
    ++recurring;
    EXPECT_GT(
        rotation_angle_between(frame.truth.map_from_camera.rotation, first.truth.map_from_camera.rotation),
        1e-4);
  }
  EXPECT_GT(recurring, 0);
}

TEST(EndlessRoom, OneSeedOneResultInAnyOrder) {
  const EndlessRoom one(small_room()), other(small_room());
  other.frame(50);
  const EndlessRoom::Frame a = one.frame(9), b = other.frame(9);
  EXPECT_EQ(cv::norm(a.image, b.image, cv::NORM_INF), 0);
  EndlessRoomOptions options = small_room();
  options.seed = 2;
  EXPECT_GT(mean_difference(EndlessRoom(options).frame(9).image, a.image), 1);
}

TEST(EndlessRoom, NoiseHasTheDeviationAskedFor) {
  EndlessRoomOptions clean = small_room(), noisy = small_room();
  clean.noise_grey_levels = 0;
  noisy.noise_grey_levels = 4;
  cv::Mat noise, mean, deviation;
  cv::subtract(EndlessRoom(noisy).frame(3).image, EndlessRoom(clean).frame(3).image, noise, cv::noArray(),
               CV_32F);
  cv::meanStdDev(noise, mean, deviation);
  EXPECT_NEAR(mean.at<double>(0), 0, 0.2);
  EXPECT_NEAR(deviation.at<double>(0), 4, 0.2);
}

TEST(EndlessRoom, RefusesWhatItCannotSimulate) {
  EndlessRoomOptions options = small_room();
  options.camera.distortion = {-0.1, 0, 0, 0, 0};
  EXPECT_THROW(EndlessRoom{options}, std::invalid_argument);
  options = small_room();
  options.rate_hz = 0;
  EXPECT_THROW(EndlessRoom{options}, std::invalid_argument);
  options = small_room();
  options.lap_frames = 2;
  EXPECT_THROW(EndlessRoom{options}, std::invalid_argument);
}

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
