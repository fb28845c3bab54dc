#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <utility>

#include "pipeline/recording.h"
#include "support/simulated_room.h"
#include "tools/looked_at_source.h"

namespace mono_pose_tracker {
namespace {

// A known number of images; counts those read.
class CountedImages : public GivenImages {
 public:
  CountedImages(const std::vector<cv::Mat>& images, int* read)
      : GivenImages(images), images_(static_cast<int>(images.size())), read_(*read) {}

  SourceImage next() override {
    ++read_;
    return GivenImages::next();
  }
  bool skip() override { return GivenImages::next().kind != SourceImage::Kind::kEnd; }
  int size() const override { return images_; }

 private:
  const int images_;
  int& read_;
};

// All numbers of a result, for a bitwise comparison.
std::vector<double> numbers_of(const RecordingResult& result, const std::vector<FrameReport>& reports,
                               const Map& map) {
  std::vector<double> numbers;
  const auto add_pose = [&](const Rigid3& pose) {
    numbers.insert(numbers.end(), pose.translation.data(), pose.translation.data() + 3);
    numbers.insert(numbers.end(), pose.rotation.coeffs().data(), pose.rotation.coeffs().data() + 4);
  };
  for (const RegisteredFrame& frame : result.trajectory) {
    numbers.push_back(static_cast<double>(frame.index));
    add_pose(frame.map_from_camera);
  }
  for (const FrameReport& report : reports) {
    numbers.push_back(report.features);
    if (report.map_from_camera) add_pose(*report.map_from_camera);
  }
  for (const LandmarkId id : map.landmark_ids()) {
    const Eigen::Vector3d& x = map.landmark(id)->x_in_map;
    numbers.insert(numbers.end(), x.data(), x.data() + 3);
  }
  return numbers;
}

class RecordingReaderTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { room_ = new SimulatedRoom(simulated_room(16, 1)); }
  static void TearDownTestSuite() { delete std::exchange(room_, nullptr); }

  static SimulatedRoom* room_;
};

SimulatedRoom* RecordingReaderTest::room_ = nullptr;

TEST_F(RecordingReaderTest, AnyNumberOfThreadsGivesTheSameBits) {
  std::vector<double> first;
  for (const int threads : {1, 2, 7}) {
    Recording recording;
    recording.open = [] { return std::make_unique<RoomImages>(*room_); };
    recording.threads = threads;
    Tracker tracker(TrackerOptions().on_threads(threads), room_->camera, Tracker::Mapping::kInline);
    std::vector<FrameReport> reports;
    std::vector<RecordingStage> stages;
    recording.begin_stage = [&](RecordingStage stage) { stages.push_back(stage); };
    const RecordingResult result = track_recording(
        recording, [&](int, std::int64_t, const FrameReport& report) { reports.push_back(report); },
        &tracker);
    ASSERT_TRUE(result.tracked);
    EXPECT_EQ(stages, (std::vector<RecordingStage>{RecordingStage::kTracking, RecordingStage::kRefining,
                                                   RecordingStage::kRegistering, RecordingStage::kRefining,
                                                   RecordingStage::kRegistering, RecordingStage::kRefining}));
    EXPECT_EQ(result.unreadable, std::set<std::int64_t>{3});
    EXPECT_EQ(result.frames_total, 15);
    EXPECT_EQ(result.problems, std::vector<std::string>{"image 3 is broken"});
    const std::vector<double> numbers = numbers_of(result, reports, tracker.map());
    EXPECT_GT(numbers.size(), 300u);
    if (first.empty()) first = numbers;
    ASSERT_EQ(numbers.size(), first.size()) << threads;
    EXPECT_EQ(std::memcmp(numbers.data(), first.data(), numbers.size() * sizeof(double)), 0) << threads;
  }
}

// Only wanted images are read again, also where some cannot be read.
TEST_F(RecordingReaderTest, ImagesThatAreNotWantedAgainAreNotReadAgain) {
  std::vector<cv::Mat> images;
  for (const SimulatedFrame& frame : room_->frames) images.push_back(frame.image);
  images.insert(images.begin() + 9, cv::Mat::zeros(images[0].size(), images[0].type()));
  for (const bool is_one_broken : {false, true}) {
    if (is_one_broken) images.insert(images.begin() + 3, cv::Mat());
    const int threads = is_one_broken ? 1 : 2;
    const auto numbers_by = [&](const std::function<std::unique_ptr<ImageSource>()>& open) {
      Recording recording;
      recording.open = open;
      recording.threads = threads;
      Tracker tracker(TrackerOptions().on_threads(threads), room_->camera, Tracker::Mapping::kInline);
      const RecordingResult result = track_recording(
          recording, [](int, std::int64_t, const FrameReport&) {}, &tracker);
      EXPECT_TRUE(result.tracked);
      return numbers_of(result, {}, tracker.map());
    };
    int read = 0, opened = 0;
    const auto numbers = numbers_by([&] { return ++opened, std::make_unique<CountedImages>(images, &read); });
    EXPECT_GE(opened, 2);
    const int most = static_cast<int>(images.size()) + 1 + 2 * (opened - 1);  // with the end, each time
    EXPECT_LE(read, most);
    EXPECT_EQ(numbers, numbers_by([&] { return std::make_unique<GivenImages>(images); }));
  }
}

// Knows what it has read, so it must not be opened again.
class RewoundImages : public CountedImages {
 public:
  using CountedImages::CountedImages;
  bool rewind() override {
    next_ = 0;
    return true;
  }
};

TEST_F(RecordingReaderTest, ARecordingThatCanBeRewoundIsOpenedOnce) {
  std::vector<cv::Mat> images;
  for (const SimulatedFrame& frame : room_->frames) images.push_back(frame.image);
  int read = 0, opened = 0;
  const LookedAtSource source([&] { return ++opened, std::make_unique<RewoundImages>(images, &read); });
  EXPECT_EQ(source.first().name, "0");
  EXPECT_EQ(source.open()->size(), static_cast<int>(images.size()));
  for (int pass = 0; pass < 3; ++pass) {
    const std::unique_ptr<ImageSource> again = source.open();
    EXPECT_TRUE(again->skip());
    EXPECT_EQ(again->next().name, "1") << pass;
  }
  EXPECT_EQ(opened, 1);
}

// Work done ahead depends on a guess of the mask and on the options of that time.
TEST_F(RecordingReaderTest, WhatWasDoneAheadChangesNothingWhateverTheMask) {
  cv::Mat mask = cv::Mat::zeros(room_->frames[0].image.size(), CV_8UC1);
  mask.colRange(0, mask.cols * 2 / 3).setTo(255);
  Tracker plain(TrackerOptions(), room_->camera, Tracker::Mapping::kInline);
  Tracker ahead(TrackerOptions(), room_->camera, Tracker::Mapping::kInline);
  for (int i = 0; i < 10; ++i) {
    const cv::Mat& image = room_->frames[i].image;
    const cv::Mat given = i % 5 == 0 ? cv::Mat() : mask;
    const cv::Mat guessed = i % 3 == 0 ? mask : cv::Mat();
    const PreparedImage prepared = ahead.prepare(image, guessed);
    if (i == 7) {
      TrackerOptions fewer;
      fewer.sift.max_features = 300;
      ahead.set_options(fewer);
      plain.set_options(fewer);
    }
    const FrameReport one = plain.process(i, image, given);
    const FrameReport other = ahead.process(i, prepared, given);
    ASSERT_EQ(one.features, other.features) << i;
    EXPECT_GT(one.features, 50) << i;
    for (int f = 0; f < one.features; ++f) ASSERT_EQ(one.seen[f].x_px, other.seen[f].x_px) << i;
    ASSERT_EQ(one.map_from_camera.has_value(), other.map_from_camera.has_value()) << i;
    if (one.map_from_camera) {
      EXPECT_EQ(one.map_from_camera->translation, other.map_from_camera->translation) << i;
    }
  }
}

}  // namespace
}  // namespace mono_pose_tracker
