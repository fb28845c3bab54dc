// Images that cannot be registered in the map, and those after them.
#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "mono_pose_tracker/tracking/tracker.h"
#include "simulation/simulated_sequence.h"
#include "support/simulated_room.h"
#include "tracking/tracker_impl.h"

namespace mono_pose_tracker {
namespace {

TEST(Tracker, ImageFromElsewhereIsLostAndTrackingGoesOn) {
  Tracker tracker(TrackerOptions(), room().camera, Tracker::Mapping::kInline);
  track_all(&tracker);
  const SimulatedFrame& last = room().frames.back();
  const FrameReport blank =
      tracker.process(last.stamp_ns + 1, cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(90)));
  EXPECT_EQ(blank.state, State::kLost);
  EXPECT_FALSE(blank.map_from_camera);
  EXPECT_EQ(blank.reason, Reason::kTooFewMatches) << blank.reason_text;
  const FrameReport searching =
      tracker.process(last.stamp_ns + 2, cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(90)));
  EXPECT_EQ(searching.reason, Reason::kRelocalising);
  EXPECT_NE(searching.reason_text.find("lost for 2 images"), std::string::npos) << searching.reason_text;
  const FrameReport held_back = tracker.process(last.stamp_ns + 3, last.image);
  EXPECT_EQ(held_back.state, State::kLost) << "a single view may be of an aliased place";
  EXPECT_EQ(held_back.reason, Reason::kRelocalising);
  EXPECT_FALSE(held_back.map_from_camera);
  const FrameReport found = tracker.process(last.stamp_ns + 4, last.image);
  EXPECT_EQ(found.state, State::kTracking) << found.reason_text;
  EXPECT_TRUE(found.map_from_camera);
  EXPECT_EQ(found.epoch, 0u);
  EXPECT_EQ(tracker.trajectory().back().stamp_ns, last.stamp_ns + 4);
  EXPECT_EQ((tracker.trajectory().end() - 2)->stamp_ns, last.stamp_ns + 3) << "known now";
}

TEST(Tracker, AViewThatNoSecondAgreesWithIsNotBelieved) {
  Tracker tracker(TrackerOptions(), room().camera, Tracker::Mapping::kInline);
  track_all(&tracker);
  const SimulatedFrame& last = room().frames.back();
  const cv::Mat blank(240, 320, CV_8UC3, cv::Scalar::all(90));
  const std::size_t registered_before = tracker.trajectory().size();
  tracker.process(last.stamp_ns + 1, blank);
  tracker.process(last.stamp_ns + 2, last.image);
  const FrameReport report = tracker.process(last.stamp_ns + 3, blank);
  EXPECT_EQ(report.state, State::kLost);
  EXPECT_EQ(tracker.trajectory().size(), registered_before);
}

// Through a hole in the lower right corner few features constrain the poses (through one elsewhere the motion
// continues).
class DoubtfulPoses : public testing::TestWithParam<bool> {};

TEST_P(DoubtfulPoses, OneAfterTheOtherIsLost) {
  Tracker tracker(TrackerOptions(), room().camera, Tracker::Mapping::kInline);
  track_all(&tracker);
  const SimulatedFrame& last = room().frames.back();
  const std::size_t registered_before = tracker.trajectory().size();
  cv::Mat covered(last.image.size(), last.image.type(), cv::Scalar::all(90));
  const cv::Rect hole(250, 190, 70, 50);
  last.image(hole).copyTo(covered(hole));
  for (int i = 1; i <= 2; ++i) {
    const FrameReport report = tracker.process(last.stamp_ns + i, covered);
    ASSERT_EQ(report.reason, Reason::kDoubtfulPose) << report.inliers << " inliers: " << report.reason_text;
    expect_consistent(report);
    // An image that cannot be registered comes in between; it counts as one image.
    const cv::Mat of_another_size(120, 160, CV_8UC3, cv::Scalar::all(90));
    if (!GetParam()) continue;
    EXPECT_FALSE(tracker.process(last.stamp_ns + i, of_another_size).map_from_camera.has_value());
  }
  const FrameReport third = tracker.process(last.stamp_ns + 3, covered);
  EXPECT_EQ(third.state, State::kLost);
  EXPECT_NE(third.reason_text.find("several doubtful poses in a row"), std::string::npos)
      << third.reason_text;
  expect_consistent(third);
  EXPECT_EQ(tracker.trajectory().size(), registered_before) << "none of the three is kept";
  EXPECT_EQ(third.withdrawn_ns, (std::vector<std::int64_t>{last.stamp_ns + 1, last.stamp_ns + 2}))
      << "whoever keeps what was reported is told";
}

INSTANTIATE_TEST_SUITE_P(Tracker, DoubtfulPoses, testing::Bool(),
                         [](const auto& info) { return info.param ? "WithOthersBetween" : "InARow"; });

// Lost for long in another place: that place gets a map of its own, and the tracker switches back to the
// first.
TEST(Tracker, ANewMapIsBegunInAdditionToTheOldOne) {
  SequenceOptions elsewhere_options;
  elsewhere_options.scene = SceneKind::kPlane;
  elsewhere_options.frames = kFrames;
  elsewhere_options.camera = room().camera.parameters();
  elsewhere_options.seed = 3;
  const SimulatedSequence elsewhere(elsewhere_options);
  TrackerOptions options;
  options.young_map_keyframes = 3;
  for (const auto mapping : {Tracker::Mapping::kInline, Tracker::Mapping::kThreaded}) {
    Tracker tracker(options, room().camera, mapping);
    const FrameReport first = track_all(&tracker).back();
    ASSERT_EQ(first.state, State::kTracking);
    ASSERT_GT(first.keyframes, options.young_map_keyframes);
    std::int64_t stamp = room().frames.back().stamp_ns;
    FrameReport second;
    int registered_elsewhere = 0;
    for (int i = 0; i < elsewhere.size(); ++i) {
      second = tracker.process(++stamp, elsewhere.render(i).image);
      tracker.wait();
      registered_elsewhere += second.map_from_camera.has_value();
    }
    EXPECT_EQ(second.state, State::kTracking) << second.reason_text;
    EXPECT_GT(second.epoch, first.epoch);
    EXPECT_NE(second.map_id, first.map_id);
    EXPECT_GT(registered_elsewhere, 5);
    FrameReport back;
    std::size_t told = 0;
    for (int i = 0; i < 3; ++i) {
      back = tracker.process(++stamp, room().frames.back().image);
      told += back.corrected.size();
    }
    EXPECT_GT(told, room().frames.size() - 3) << "the frames of the map gone back to";
    EXPECT_EQ(back.state, State::kTracking) << back.reason_text;
    EXPECT_EQ(back.map_id, first.map_id);
    EXPECT_GT(back.epoch, second.epoch);
    EXPECT_TRUE(back.corrected.empty()) << "told once";
    const Eigen::Vector3d moved = back.map_from_camera->translation - first.map_from_camera->translation;
    EXPECT_LT(moved.norm(), 0.02) << "in the frame it had, whose first points are at depth 1";
    ASSERT_TRUE(tracker.finish());
    const std::vector<FinishedMap> maps = tracker.impl().maps();
    ASSERT_EQ(maps.size(), 2u) << "they have nothing in common";
    EXPECT_EQ(maps[0].id, first.map_id);
    EXPECT_EQ(maps[1].id, second.map_id);
    EXPECT_GE(maps[1].trajectory.size(), static_cast<std::size_t>(registered_elsewhere));
    for (const FinishedMap& map : maps) map.map.check();
  }
}

}  // namespace
}  // namespace mono_pose_tracker
