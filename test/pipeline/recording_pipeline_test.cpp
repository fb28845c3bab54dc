#include "pipeline/recording_pipeline.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/rotation.h"
#include "support/random_texture.h"
#include "support/simulated_room.h"

namespace mono_pose_tracker {
namespace {

FrameObserver nothing_observed(int) {
  return [](int, std::int64_t, const FrameReport&) {};
}

TrackedRecording run_pipeline(const Recording& recording, const CameraParameters& camera,
                              const ObserverOfAttempt& observer_of) {
  return RecordingPipeline(recording, TrackerOptions(), {camera}, observer_of).run();
}

class RecordingPipelineTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { room_ = new SimulatedRoom(simulated_room(16, 1)); }
  static void TearDownTestSuite() { delete std::exchange(room_, nullptr); }

  static const CameraParameters& camera() { return room_->camera.parameters(); }
  static Recording recording() {
    Recording recording;
    recording.open = [] { return std::make_unique<RoomImages>(*room_); };
    return recording;
  }

  static SimulatedRoom* room_;
};

SimulatedRoom* RecordingPipelineTest::room_ = nullptr;

// A room fills the view and is static: the first result is confirmed.
TEST_F(RecordingPipelineTest, AConfirmedRecordingIsTrackedOnce) {
  std::vector<int> attempts;
  const TrackedRecording tracked = run_pipeline(recording(), camera(), [&](int attempt) {
    attempts.push_back(attempt);
    return nothing_observed(attempt);
  });
  EXPECT_EQ(attempts, std::vector<int>{0});
  EXPECT_EQ(tracked.attempt, 0);
  EXPECT_TRUE(is_confirmed(tracked.result));
  EXPECT_TRUE(tracked.result.warnings.empty());
  EXPECT_EQ(tracked.calibration.camera, camera());
  EXPECT_EQ(tracked.calibration.source, CalibrationSource::kGiven);
  EXPECT_EQ(tracked.calibration.runs, 0);
}

TEST_F(RecordingPipelineTest, AWrongCameraIsReportedWithAnyNumberOfThreads) {
  const SimulatedRoom room = simulated_room(40, 2);
  CameraParameters raw = room.camera.parameters();  // its images are rectified
  raw.distortion = {-0.3, 0.1, 0, 0, 0};
  std::vector<std::vector<std::string>> warnings;
  for (const int threads : {1, 2}) {
    Recording given;
    given.open = [&] { return std::make_unique<RoomImages>(room); };
    given.threads = threads;
    const TrackedRecording tracked = run_pipeline(given, raw, nothing_observed);
    ASSERT_TRUE(tracked.result.tracked);
    EXPECT_TRUE(tracked.result.maps.front().quality.has(FindingKind::kCalibration));
    EXPECT_FALSE(is_confirmed(tracked.result));
    warnings.push_back(tracked.result.warnings);
  }
  EXPECT_EQ(warnings[0], warnings[1]);
}

// The beginning of the recording is attempt -1, and with each camera the attempts begin with 0.
TEST_F(RecordingPipelineTest, AWrongCameraIsRefinedWhereThatIsAskedFor) {
  const SimulatedRoom room = simulated_room(40, 2);
  CameraParameters longer = room.camera.parameters();
  longer.fx *= 1.3, longer.fy *= 1.3;
  Recording recording;
  recording.open = [&] { return std::make_unique<RoomImages>(room); };
  std::vector<int> attempts;
  const auto observer_of = [&](int attempt) {
    attempts.push_back(attempt);
    return nothing_observed(attempt);
  };
  const TrackedRecording tracked =
      RecordingPipeline(recording, TrackerOptions(), {longer, CalibrationSource::kGuessed, true}, observer_of)
          .run();
  ASSERT_TRUE(tracked.result.tracked);
  EXPECT_EQ(tracked.calibration.source, CalibrationSource::kRefined);
  EXPECT_NEAR(tracked.calibration.camera.fx / room.camera.parameters().fx, 1, 0.02);
  EXPECT_EQ(attempts.front(), RecordingPipeline::kBeginning);
  EXPECT_EQ(attempts.back(), tracked.attempt);
  EXPECT_GE(attempts.size(), static_cast<std::size_t>(tracked.calibration.runs));
  EXPECT_FALSE(tracked.result.maps.front().quality.has(FindingKind::kCalibration));
}

class SpoiltImages : public RoomImages {
 public:
  using RoomImages::RoomImages;
  SourceImage next() override {
    SourceImage image = RoomImages::next();
    if (!image.image.empty()) image.image = random_texture(image.image.cols, image.image.rows, 1);
    return image;
  }
};

// The room, whose images all show the same picture when they are read for the first time. No features are
// kept.
Recording spoilt_at_first(const SimulatedRoom& room, int* opened) {
  Recording recording;
  recording.open = [&room, opened]() -> std::unique_ptr<ImageSource> {
    if (++*opened == 1) return std::make_unique<SpoiltImages>(room);
    return std::make_unique<RoomImages>(room);
  };
  recording.feature_memory.memory_bytes = 0;
  recording.feature_memory.file_bytes = 0;
  return recording;
}

TEST_F(RecordingPipelineTest, WithoutAMapItIsTriedFromElsewhere) {
  int opened = 0;
  const TrackedRecording tracked = run_pipeline(spoilt_at_first(*room_, &opened), camera(), nothing_observed);
  EXPECT_EQ(tracked.attempt, 1);
  ASSERT_TRUE(tracked.result.tracked);
  EXPECT_EQ(tracked.result.trajectory.size(), 15u);
}

TEST_F(RecordingPipelineTest, TheObserverOfAResultThatIsNotKeptIsFreed) {
  int opened = 0;
  std::vector<std::weak_ptr<int>> owned;
  const TrackedRecording tracked = run_pipeline(spoilt_at_first(*room_, &opened), camera(), [&](int) {
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
TEST_F(RecordingPipelineTest, AMapOfFewOfTheImagesIsTriedFromElsewhereAndNotConfirmed) {
  std::vector<cv::Mat> images;
  for (const SimulatedFrame& frame : room_->frames) images.push_back(frame.image);
  const std::size_t of_room = images.size();
  for (std::size_t i = 0; i <= of_room; ++i)
    images.push_back(random_texture(images[0].cols, images[0].rows, 100 + static_cast<int>(i)));
  Recording recording;
  recording.open = [&] { return std::make_unique<GivenImages>(images); };
  std::set<int> begun;
  std::set<std::int64_t> begun_at;
  const TrackedRecording tracked = run_pipeline(recording, camera(), [&](int attempt) {
    return [&, attempt](int pass, std::int64_t index, const FrameReport&) {
      if (pass == 1 && begun.insert(attempt).second) begun_at.insert(index);
    };
  });
  EXPECT_EQ(tracked.result.trajectory.size(), room_->frames.size());
  EXPECT_FALSE(tracked.result.maps.front().confirmed());
  EXPECT_GE(begun_at.size(), 3u);
}

// The first images have a mask, such as one found before the map was lost and begun again.
class MaskedAtFirst : public GivenImages {
 public:
  MaskedAtFirst(const std::vector<cv::Mat>& images, const std::vector<cv::Mat>& masks)
      : GivenImages(images), masks_(masks) {}

  SourceImage next() override {
    const std::size_t index = next_;
    SourceImage image = GivenImages::next();
    if (index < masks_.size()) image.mask = masks_[index];
    return image;
  }

 private:
  const std::vector<cv::Mat>& masks_;
};

TEST_F(RecordingPipelineTest, MasksOfSomeImagesDoNotHideABackgroundInTheOthers) {
  constexpr int kFrames = 40, kMasked = 4;
  SequenceOptions options;
  options.scene = SceneKind::kHead;
  options.background = BackgroundKind::kTextured;
  options.frames = kFrames;
  options.camera = default_camera(SceneKind::kHead, 320, 240);
  const SimulatedSequence sequence(options);
  std::vector<cv::Mat> images, masks;
  for (int i = 0; i < kFrames; ++i) {
    const SimulatedFrame frame = sequence.render(i);
    images.push_back(frame.image);
    if (i < kMasked) masks.push_back(frame.mask);
  }
  Recording recording;
  recording.open = [&] { return std::make_unique<MaskedAtFirst>(images, masks); };
  const TrackedRecording tracked = run_pipeline(recording, sequence.camera().parameters(), nothing_observed);
  ASSERT_TRUE(tracked.result.tracked);
  EXPECT_TRUE(is_confirmed(tracked.result));
  EXPECT_NE(tracked.object_masks, nullptr);
}

// A picture in the picture: from the fifth image on most of it shows another room, as from a camera that
// moves in the opposite direction. The map continues with the rest of the first room.
TEST_F(RecordingPipelineTest, AMapOfTheSmallerOfTwoObjectsIsRebuiltOfTheLarger) {
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
  const TrackedRecording tracked = run_pipeline(recording, first.camera.parameters(), nothing_observed);
  const RecordingResult& result = tracked.result;
  ASSERT_TRUE(result.tracked);
  EXPECT_GT(tracked.attempt, 0);
  EXPECT_NE(result.maps.front().other_object, OtherObject::kLarger);
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

}  // namespace
}  // namespace mono_pose_tracker
