#include "pipeline/recording.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/rotation.h"
#include "simulation/simulated_sequence.h"
#include "support/random_texture.h"
#include "support/simulated_room.h"

namespace mono_pose_tracker {
namespace {

class RecordingTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { room_ = new SimulatedRoom(simulated_room(16, 1)); }
  static void TearDownTestSuite() { delete std::exchange(room_, nullptr); }

  static SimulatedRoom* room_;
};

SimulatedRoom* RecordingTest::room_ = nullptr;

RecordingResult track(const std::vector<cv::Mat>& images, const CameraModel& camera) {
  Recording recording;
  recording.open = [&] { return std::make_unique<GivenImages>(images); };
  Tracker tracker(TrackerOptions(), camera, Tracker::Mapping::kInline);
  return track_recording(
      recording, [](int, std::int64_t, const FrameReport&) {}, &tracker);
}

// Of the final map; with one thread RecordingPipeline makes the test later.
TEST_F(RecordingTest, TheCalibrationIsTestedInParallelWithTheOtherChecks) {
  CameraParameters longer = room_->camera.parameters();
  longer.fx *= 1.2, longer.fy *= 1.2;
  for (const int threads : {1, 2}) {
    Recording recording;
    recording.open = [] { return std::make_unique<RoomImages>(*room_); };
    recording.threads = threads;
    recording.calibration_test = CalibrationTest{{}, longer};
    Tracker tracker(TrackerOptions().on_threads(threads), room_->camera, Tracker::Mapping::kInline);
    const RecordingResult result = track_recording(
        recording, [](int, std::int64_t, const FrameReport&) {}, &tracker);
    ASSERT_TRUE(is_confirmed(result));
    ASSERT_EQ(result.calibration_doubt.has_value(), threads > 1);
    const std::string expected = doubt_of_calibration({}, longer, tracker.map());
    EXPECT_EQ(result.calibration_doubt.value_or(expected), expected);
  }
}

TEST_F(RecordingTest, BlackImagesAreNotMissed) {
  std::vector<cv::Mat> images;
  for (const SimulatedFrame& frame : room_->frames) images.push_back(frame.image);
  images.resize(2 * images.size() + 2, cv::Mat::zeros(images[0].size(), images[0].type()));
  const RecordingResult result = track(images, room_->camera);
  EXPECT_EQ(result.trajectory.size(), room_->frames.size());
  EXPECT_TRUE(result.maps.front().confirmed());
}

// The largest error of rotation, rad, after the paths are aligned at their first frames.
double worst_rotation(const std::vector<RegisteredFrame>& frames, const std::vector<StampedPose>& truth,
                      int step) {
  const RegisteredFrame& first = frames.front();
  double worst = 0;
  for (const RegisteredFrame& frame : frames) {
    const Rigid3 found = first.map_from_camera.inverse() * frame.map_from_camera,
                 right = truth[step * first.index].map_from_camera.inverse() *
                         truth[step * frame.index].map_from_camera;
    worst = std::max(worst, rotation_angle_between(found.rotation, right.rotation));
  }
  return worst;
}

// A near wall may give the second planar solution, in which images between keyframes have other poses.
TEST(WallRecording, ImagesOfTheSecondPlanarSolutionAreRegisteredAgain) {
  SequenceOptions wall;
  wall.scene = SceneKind::kPlane;
  wall.camera = default_camera(SceneKind::kPlane, 640, 480);
  wall.camera.fx = wall.camera.fy = 320 / std::tan(41 * kDegree);  // wide
  wall.frames = 90;
  wall.seed = 12;
  wall.noise_grey_levels = 1.9;
  const SimulatedSequence sequence(wall);
  constexpr int kStep = 3;
  std::vector<cv::Mat> images;
  for (int i = 0; i < sequence.size(); i += kStep) images.push_back(sequence.render(i).image);

  Tracker as_they_come(TrackerOptions(), sequence.camera(), Tracker::Mapping::kInline);
  for (std::size_t i = 0; i < images.size(); ++i) {
    as_they_come.process(static_cast<std::int64_t>(i) * 100'000'000, images[i]);
  }
  EXPECT_EQ(as_they_come.trajectory().size(), images.size());
  // Interpolation between keyframes, where the hand shakes.
  EXPECT_LT(worst_rotation(as_they_come.trajectory(), sequence.path(), kStep), 0.6 * kDegree);

  const RecordingResult result = track(images, sequence.camera());
  EXPECT_EQ(result.trajectory.size(), images.size());
  EXPECT_LT(worst_rotation(result.trajectory, sequence.path(), kStep), 0.05 * kDegree);
}

// Images before the first tracked one are registered in the end.
TEST_F(RecordingTest, AMapMayBeginLaterThanTheRecording) {
  Recording recording;
  recording.open = [] { return std::make_unique<RoomImages>(*room_); };
  recording.first_tracked = 5;
  Tracker tracker(TrackerOptions(), room_->camera, Tracker::Mapping::kInline);
  std::int64_t first = -1;
  const RecordingResult result = track_recording(
      recording,
      [&](int pass, std::int64_t index, const FrameReport&) {
        if (pass == 1 && first < 0) first = index;
      },
      &tracker);
  EXPECT_EQ(first, 5);
  EXPECT_EQ(result.frames_total, 15);
  EXPECT_EQ(result.names.size(), 15u);
  EXPECT_EQ(result.trajectory.size(), 15u);
}

TEST_F(RecordingTest, BlackImagesBeforeTheMapAreNotMissed) {
  constexpr int kBlack = 10;
  std::vector<cv::Mat> images(kBlack, cv::Mat::zeros(room_->frames[0].image.size(), CV_8UC3));
  for (const SimulatedFrame& frame : room_->frames) images.push_back(frame.image);
  Recording recording;
  recording.open = [&] { return std::make_unique<GivenImages>(images); };
  recording.first_tracked = kBlack;
  Tracker tracker(TrackerOptions(), room_->camera, Tracker::Mapping::kInline);
  const RecordingResult result = track_recording(
      recording, [](int, std::int64_t, const FrameReport&) {}, &tracker);
  EXPECT_EQ(result.frames_with_features, static_cast<std::int64_t>(room_->frames.size()));
  EXPECT_TRUE(is_confirmed(result));
  ASSERT_FALSE(result.warnings.empty());
  EXPECT_NE(result.warnings.back().find("these images have no features"), std::string::npos);
}

// A picture with an unrelated motion occludes all but a fifth of the images before the map's beginning: too
// little for a place, enough next to a registered frame. Of two images held at a time those nearest to the
// beginning come first.
TEST_F(RecordingTest, WhatIsFollowedBackwardsMayHangOnAPartOfTheImage) {
  std::vector<cv::Mat> images;
  for (const SimulatedFrame& frame : room_->frames) images.push_back(frame.image.clone());
  constexpr int kHidden = 5;
  for (int i = 0; i < kHidden; ++i) {
    const cv::Rect place(images[i].cols / 5, 0, images[i].cols - images[i].cols / 5, images[i].rows);
    cv::Mat picture;
    cv::cvtColor(random_texture(place.width, place.height, 7 + i), picture, cv::COLOR_GRAY2BGR);
    picture.copyTo(images[i](place));
  }
  Recording recording;
  recording.open = [&] { return std::make_unique<GivenImages>(images); };
  recording.first_tracked = kHidden;
  recording.most_held = 2;
  Tracker tracker(TrackerOptions(), room_->camera, Tracker::Mapping::kInline);
  const RecordingResult result = track_recording(
      recording, [](int, std::int64_t, const FrameReport&) {}, &tracker);
  ASSERT_EQ(result.trajectory.size(), images.size());
  const Rigid3 truth = room_->truth[0].map_from_camera.inverse() * room_->truth[10].map_from_camera;
  const Rigid3 found = result.trajectory[0].map_from_camera.inverse() * result.trajectory[10].map_from_camera;
  EXPECT_LT(rotation_angle_between(found.rotation, truth.rotation), 0.3 * kDegree);
}

std::vector<cv::Mat> one_after_the_other(const SimulatedRoom& first, const SimulatedRoom& second) {
  std::vector<cv::Mat> images;
  for (const SimulatedRoom* room : {&first, &second}) {
    for (const SimulatedFrame& frame : room->frames) images.push_back(frame.image);
  }
  return images;
}

// Another room after a cut: the recording ends before the camera is lost long enough for a new map.
TEST_F(RecordingTest, WhatFollowsACutHasAMapOfItsOwnHoweverShort) {
  const SimulatedRoom other = simulated_room(7, 1, 2);
  const std::vector<cv::Mat> images = one_after_the_other(*room_, other);
  const RecordingResult result = track(images, room_->camera);
  ASSERT_TRUE(result.tracked);
  EXPECT_EQ(result.trajectory.size(), 16u);
  ASSERT_EQ(result.maps.size(), 2u);
  const std::vector<RegisteredFrame>& apart = result.maps[1].trajectory;
  ASSERT_EQ(apart.size(), 7u);
  EXPECT_EQ(apart.front().index, 16);
  EXPECT_EQ(apart.back().index, 22);
  EXPECT_TRUE(result.maps[0].quality.has(FindingKind::kSeveralMaps));
  EXPECT_TRUE(result.maps[1].quality.has(FindingKind::kFewImages));
  EXPECT_FALSE(result.maps[1].confirmed());
  ASSERT_FALSE(result.warnings.empty());
  EXPECT_NE(result.warnings[0].find("2 maps that share no matches; 7 images"), std::string::npos)
      << result.warnings[0];
}

// The new map begins ten images after the loss; those ten have the same view.
TEST_F(RecordingTest, ASecondMapGetsTheImagesBeforeItsBeginning) {
  const SimulatedRoom other = simulated_room(26, 1, 2);
  const std::vector<cv::Mat> images = one_after_the_other(*room_, other);
  const RecordingResult result = track(images, room_->camera);
  ASSERT_TRUE(result.tracked);
  ASSERT_EQ(result.maps.size(), 2u);
  EXPECT_EQ(result.maps[0].trajectory.size() + result.maps[1].trajectory.size(), images.size());
}

// Registered images keep their poses.
TEST_F(RecordingTest, AnInterruptedSecondRegistrationIsReported) {
  std::vector<cv::Mat> images;
  for (const SimulatedFrame& frame : room_->frames) images.push_back(frame.image);
  images.push_back(cv::Mat::zeros(images[0].size(), images[0].type()));  // it has no pose, and is tried again
  Recording recording;
  bool is_over = false;
  int opened = 0;
  recording.open = [&] {
    is_over = ++opened > 1;  // as soon as the images are read again
    return std::make_unique<GivenImages>(images);
  };
  recording.interrupted = [&] { return is_over; };
  Tracker tracker(TrackerOptions(), room_->camera, Tracker::Mapping::kInline);
  std::set<std::int64_t> registered;
  const RecordingResult result = track_recording(
      recording,
      [&](int, std::int64_t index, const FrameReport& report) {
        if (report.map_from_camera) registered.insert(index);
      },
      &tracker);
  ASSERT_TRUE(result.tracked);
  EXPECT_GE(opened, 2);
  EXPECT_GE(result.trajectory.size(), registered.size());
  ASSERT_FALSE(result.warnings.empty());
  EXPECT_EQ(result.warnings[0], "interrupted before all images were registered again: some may have no pose");
}

// The map is finished all the same.
TEST_F(RecordingTest, AnInterruptedRefinementIsReported) {
  std::vector<cv::Mat> images;
  for (const SimulatedFrame& frame : room_->frames) images.push_back(frame.image);
  Recording recording;
  recording.open = [&] { return std::make_unique<GivenImages>(images); };
  bool is_over = false;
  recording.begin_stage = [&](RecordingStage stage) { is_over |= stage == RecordingStage::kRefining; };
  recording.interrupted = [&] { return is_over; };
  Tracker tracker(TrackerOptions(), room_->camera, Tracker::Mapping::kInline);
  const RecordingResult result = track_recording(
      recording, [](int, std::int64_t, const FrameReport&) {}, &tracker);
  ASSERT_TRUE(result.tracked);
  ASSERT_FALSE(result.warnings.empty());
  EXPECT_EQ(result.warnings[0], "interrupted before all images were registered again: some may have no pose");
}

TEST_F(RecordingTest, ImagesWithoutAPoseAreTold) {
  std::vector<cv::Mat> images;
  for (const SimulatedFrame& frame : room_->frames) images.push_back(frame.image);
  images.push_back(cv::Mat::zeros(images[0].size(), images[0].type()));
  EXPECT_TRUE(track(images, room_->camera).warnings.empty()) << "a single dark one";
  images.push_back(images.back());
  const RecordingResult result = track(images, room_->camera);
  EXPECT_EQ(result.trajectory.size(), 16u);
  ASSERT_EQ(result.warnings.size(), 1u);
  EXPECT_EQ(
      result.warnings[0],
      "2 of 18 images have no pose, the longest gap is from 16 to 17: these images have no features, or "
      "not the size of the calibration.");
}

TEST_F(RecordingTest, AnImageOfAnotherSizeIsNamedWithTheCause) {
  std::vector<cv::Mat> images;
  for (const SimulatedFrame& frame : room_->frames) images.push_back(frame.image);
  cv::Mat upright;
  cv::rotate(images[3], upright, cv::ROTATE_90_CLOCKWISE);
  images[3] = images[4] = upright;
  const RecordingResult result = track(images, room_->camera);
  ASSERT_EQ(result.problems.size(), 2u);
  EXPECT_NE(result.problems[0].find("width and height are swapped"), std::string::npos) << result.problems[0];
  ASSERT_EQ(result.warnings.size(), 1u);
  EXPECT_NE(result.warnings[0].find("from 3 to 4: these images have no features, or not the size"),
            std::string::npos)
      << result.warnings[0];
}

}  // namespace
}  // namespace mono_pose_tracker
