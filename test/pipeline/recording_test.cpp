#include "pipeline/recording.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <set>
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

// About the final map; with one thread the caller checks it itself.
TEST_F(RecordingTest, TheCallersDoubtIsAskedInParallelWithTheOtherChecks) {
  for (const int threads : {1, 2}) {
    Recording recording;
    recording.open = [] { return std::make_unique<RoomImages>(*room_); };
    recording.threads = threads;
    recording.doubt_of = [](const Map& map, const std::function<bool()>&) {
      return std::to_string(map.landmarks().size()) + " points";
    };
    Tracker tracker(TrackerOptions().on_threads(threads), room_->camera, Tracker::Mapping::kInline);
    const RecordingResult result = track_recording(
        recording, [](int, std::int64_t, const FrameReport&) {}, &tracker);
    ASSERT_TRUE(is_confirmed(result));
    ASSERT_EQ(result.doubt.has_value(), threads > 1);
    const std::string expected = std::to_string(tracker.map().landmarks().size()) + " points";
    EXPECT_EQ(result.doubt.value_or(expected), expected);
  }
}

// Options for each run.
TrackedRecording track_until_confirmed(const SimulatedRoom& room,
                                       const std::function<TrackerOptions()>& options) {
  Recording recording;
  recording.open = [&] { return std::make_unique<RoomImages>(room); };
  return track_until_confirmed(
      recording, [&] { return std::make_unique<Tracker>(options(), room.camera, Tracker::Mapping::kInline); },
      [](int) { return [](int, std::int64_t, const FrameReport&) {}; });
}

// A room fills the view and is static: the first result is confirmed.
TEST_F(RecordingTest, AConfirmedRecordingIsTrackedOnce) {
  int attempts = 0;
  const TrackedRecording tracked = track_until_confirmed(*room_, [&] {
    ++attempts;
    return TrackerOptions();
  });
  EXPECT_EQ(attempts, 1);
  EXPECT_EQ(tracked.attempt, 0);
  EXPECT_TRUE(is_confirmed(tracked.result));
  EXPECT_TRUE(tracked.result.warnings.empty());
}

// The first run has bad options; the second one's result is to be returned.
TrackedRecording track_with_spoilt_first(const SimulatedRoom& room,
                                         const std::function<void(TrackerOptions*)>& spoil) {
  int attempts = 0;
  TrackedRecording tracked = track_until_confirmed(room, [&] {
    TrackerOptions options;
    if (++attempts == 1) spoil(&options);
    return options;
  });
  EXPECT_EQ(attempts, 2);
  EXPECT_EQ(tracked.attempt, 1);
  return tracked;
}

// The first seed gives no map, whatever the images show.
TEST_F(RecordingTest, WithoutAMapItIsTriedFromElsewhere) {
  const TrackedRecording tracked =
      track_with_spoilt_first(*room_, [](TrackerOptions* o) { o->bootstrap.min_matches = 1000000; });
  ASSERT_TRUE(tracked.result.tracked);
  EXPECT_EQ(tracked.result.trajectory.size(), 15u);
}

TEST_F(RecordingTest, TheObserverOfAResultThatIsNotKeptIsFreed) {
  Recording recording;
  recording.open = [&] { return std::make_unique<RoomImages>(*room_); };
  std::vector<std::weak_ptr<int>> owned;
  const TrackedRecording tracked = track_until_confirmed(
      recording,
      [&] {
        TrackerOptions options;
        if (owned.empty()) options.bootstrap.min_matches = 1000000;
        return std::make_unique<Tracker>(options, room_->camera, Tracker::Mapping::kInline);
      },
      [&](int) {
        const auto data = std::make_shared<int>(0);
        owned.push_back(data);
        return [data](int, std::int64_t, const FrameReport&) { ++*data; };
      });
  ASSERT_EQ(owned.size(), 2u);
  ASSERT_EQ(tracked.attempt, 1);
  EXPECT_TRUE(owned[0].expired());
  ASSERT_FALSE(owned[1].expired());
  EXPECT_GE(*owned[1].lock(), 15);
}

// There is no finding against it, and no other seed gives more.
TEST_F(RecordingTest, AMapOfFewOfTheImagesIsTriedFromElsewhereAndNotConfirmed) {
  std::vector<cv::Mat> images;
  for (const SimulatedFrame& frame : room_->frames) images.push_back(frame.image);
  const std::size_t of_room = images.size();
  for (std::size_t i = 0; i <= of_room; ++i)
    images.push_back(random_texture(images[0].cols, images[0].rows, 100 + static_cast<int>(i)));
  Recording recording;
  recording.open = [&] { return std::make_unique<GivenImages>(images); };
  std::set<int> begun;
  std::set<std::int64_t> begun_at;
  const TrackedRecording tracked = track_until_confirmed(
      recording,
      [&] { return std::make_unique<Tracker>(TrackerOptions(), room_->camera, Tracker::Mapping::kInline); },
      [&](int attempt) {
        return [&, attempt](int pass, std::int64_t index, const FrameReport&) {
          if (pass == 1 && begun.insert(attempt).second) begun_at.insert(index);
        };
      });
  EXPECT_EQ(tracked.result.trajectory.size(), room_->frames.size());
  EXPECT_FALSE(tracked.result.maps.front().confirmed());
  EXPECT_GE(begun_at.size(), 3u);
}

TEST_F(RecordingTest, BlackImagesAreNotMissed) {
  std::vector<cv::Mat> images;
  for (const SimulatedFrame& frame : room_->frames) images.push_back(frame.image);
  images.resize(2 * images.size() + 2, cv::Mat::zeros(images[0].size(), images[0].type()));
  const RecordingResult result = track(images, room_->camera);
  EXPECT_EQ(result.trajectory.size(), room_->frames.size());
  EXPECT_TRUE(result.maps.front().confirmed());
}

// A picture in the picture: from the fifth image on most of it shows another room, as from a camera that
// moves in the opposite direction. The map continues with the rest of the first room.
TEST_F(RecordingTest, AMapOfTheSmallerOfTwoObjectsIsRebuiltOfTheLarger) {
  constexpr int kFrames = 30, kAlone = 5, kStride = 3;
  const SimulatedRoom first = simulated_room(kFrames, 1), second = simulated_room(kStride * kFrames, 1, 2);
  const auto shown = [](std::int64_t i) { return kStride * (kFrames - 1 - i); };
  std::vector<cv::Mat> images;
  for (int i = 0; i < kFrames; ++i) {
    images.push_back(first.frames[i].image.clone());
    const cv::Rect place(images[i].cols / 3, 0, images[i].cols - images[i].cols / 3, images[i].rows);
    if (i >= kAlone) second.frames[shown(i)].image(place).copyTo(images[i](place));
  }
  Recording recording;
  recording.open = [&] { return std::make_unique<GivenImages>(images); };
  std::vector<int> attempts;
  const TrackedRecording tracked = track_until_confirmed(
      recording,
      [&] { return std::make_unique<Tracker>(TrackerOptions(), first.camera, Tracker::Mapping::kInline); },
      [&](int attempt) {
        attempts.push_back(attempt);
        return [](int, std::int64_t, const FrameReport&) {};
      });
  const RecordingResult& result = tracked.result;
  ASSERT_TRUE(result.tracked);
  EXPECT_GT(tracked.attempt, 0);
  EXPECT_FALSE(result.maps.front().is_of_smaller_object);
  const RegisteredFrame &a = result.trajectory[result.trajectory.size() / 4], &b = result.trajectory.back();
  const auto truth = [&](const RegisteredFrame& frame) {
    return second.truth[shown(frame.index)].map_from_camera;
  };
  EXPECT_LT(rotation_angle_between((a.map_from_camera.inverse() * b.map_from_camera).rotation,
                                   (truth(a).inverse() * truth(b)).rotation),
            1.5 * kDegree);
  // The first images show the other room alone.
  EXPECT_EQ(result.trajectory.size(), static_cast<std::size_t>(kFrames - kAlone));
  EXPECT_EQ(result.trajectory.front().index, kAlone);
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
  EXPECT_EQ(result.warnings[0], "interrupted while images were registered again: some may have no pose");
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
