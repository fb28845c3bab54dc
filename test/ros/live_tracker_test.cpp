#include <gtest/gtest.h>
#include <sensor_msgs/image_encodings.h>

#include <boost/make_shared.hpp>
#include <future>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "ros/camera_info.h"
#include "ros/live_tracker.h"

namespace mono_pose_tracker {
namespace {

using std::chrono::milliseconds;

// Much more than a busy machine needs; only a failure takes so long.
constexpr milliseconds kLong{60000};

sensor_msgs::ImageConstPtr mask_at(double seconds) {
  auto mask = boost::make_shared<sensor_msgs::Image>();
  mask->header.stamp = ros::Time(seconds);
  return mask;
}

TEST(MaskSource, GivesTheMaskOfTheImagesStamp) {
  MaskSource masks;
  const auto first = mask_at(1), second = mask_at(2);
  masks.put(first);
  masks.put(second);
  EXPECT_EQ(masks.wait(ros::Time(2), kLong), second);
  EXPECT_EQ(masks.wait(ros::Time(1), kLong), first);
}

TEST(MaskSource, WithoutOneTheWaitEnds) {
  MaskSource masks;
  masks.put(mask_at(1));
  EXPECT_EQ(masks.wait(ros::Time(1.000000001), milliseconds(0)), nullptr)
      << "a stamp is equal or it is another";
  const auto before = std::chrono::steady_clock::now();
  EXPECT_EQ(masks.wait(ros::Time(2), milliseconds(20)), nullptr);
  EXPECT_GE(std::chrono::steady_clock::now() - before, milliseconds(20));
}

TEST(MaskSource, TheImageWaitsForItsMask) {
  MaskSource masks;
  auto waiting = std::async(std::launch::async, [&] { return masks.wait(ros::Time(2), kLong); });
  masks.put(mask_at(1));  // not the one
  const auto mask = mask_at(2);
  masks.put(mask);
  EXPECT_EQ(waiting.get(), mask);
}

// Whatever ~mask_timeout is, who ends the node does not wait so long.
TEST(MaskSource, CancelledNobodyWaits) {
  MaskSource masks;
  auto waiting = std::async(std::launch::async, [&] { return masks.wait(ros::Time(2), kLong); });
  const auto before = std::chrono::steady_clock::now();
  masks.cancel();
  EXPECT_EQ(waiting.get(), nullptr);
  EXPECT_EQ(masks.wait(ros::Time(3), kLong), nullptr);
  EXPECT_LT(std::chrono::steady_clock::now() - before, kLong);
}

// Whoever publishes masks without end for images that never come must not fill the memory.
TEST(MaskSource, OldMasksGo) {
  MaskSource masks;
  for (int i = 1; i <= 1000; ++i) masks.put(mask_at(i));
  EXPECT_EQ(masks.wait(ros::Time(1), milliseconds(0)), nullptr);
  EXPECT_NE(masks.wait(ros::Time(1000), milliseconds(0)), nullptr);
  int kept = 0;
  for (int i = 1; i <= 1000; ++i) kept += masks.wait(ros::Time(i), milliseconds(0)) != nullptr;
  EXPECT_LE(kept, 30);
  EXPECT_GE(kept, 5) << "a segmentation may be some images ahead";
}

/// A keyframe that sees these landmarks.
KeyframeView keyframe(KeyframeId id, const std::vector<LandmarkId>& landmarks) {
  KeyframeView view;
  view.id = id;
  view.stamp_ns = 1000 + id;
  auto image = std::make_shared<ImageFeatures>();
  image->color_rgb.assign(landmarks.size(), cv::Vec3b(10, 20, 30));
  view.image = image;
  view.landmark_of_feature = landmarks;
  return view;
}

TEST(DrawnMap, IsCopiedOnceAndWhenItIsAskedFor) {
  auto map = std::make_shared<TrackingMap>();
  map->epoch = 3;
  for (int i = 0; i < 5; ++i) map->landmarks.set(i, Eigen::Vector3d(i, 0, 1));
  map->keyframes.set(0, keyframe(0, {0, 1, 2, -1}));
  map->keyframes.set(1, keyframe(1, {2, 3, 7}));  // 7 is no more
  const DrawnMap drawn(map);
  EXPECT_TRUE(drawn.has_points());
  EXPECT_EQ(drawn.newest().epoch, 3u);
  ASSERT_EQ(drawn.newest().keyframes.size(), 1u);
  EXPECT_EQ(drawn.newest().keyframes[0].stamp_ns, 1001);
  EXPECT_EQ(drawn.newest().points.size(), 2u);
  EXPECT_FALSE(drawn.is_copied()) << "the whole map, for nobody";
  const MapSnapshot& all = drawn.all();
  EXPECT_EQ(all.points.size(), 4u);
  EXPECT_EQ(all.keyframes.size(), 2u);
  EXPECT_TRUE(drawn.is_copied());
  EXPECT_EQ(&drawn.all(), &all);
}

TEST(DrawnMap, MayBeNone) {
  const DrawnMap none(nullptr);
  EXPECT_FALSE(none.has_points());
  EXPECT_TRUE(none.newest().keyframes.empty());
  EXPECT_TRUE(none.all().points.empty());
}

class LiveTrackerTest : public testing::Test {
 protected:
  LiveTrackerTest() { calibrate(150); }

  /// A calibration of this focal length.
  void calibrate(double focal) {
    CameraParameters camera;
    camera.width = 160;
    camera.height = 120;
    camera.fx = camera.fy = focal;
    camera.cx = 80;
    camera.cy = 60;
    cameras_.set_message(boost::make_shared<sensor_msgs::CameraInfo>(to_camera_info(camera)));
  }

  /// To a blank image.
  Reason answer() {
    auto image = boost::make_shared<sensor_msgs::Image>();
    image->header.stamp = ros::Time(++seconds_);
    image->encoding = sensor_msgs::image_encodings::MONO8;
    image->width = image->step = 160;
    image->height = 120;
    image->data.assign(160 * 120, 128);
    return tracker_.process(image).reason;
  }

  /// To a noise image, of which the left part is transparent.
  FrameReport answer_to_cut_out(int transparent_columns) {
    auto image = boost::make_shared<sensor_msgs::Image>();
    image->header.stamp = ros::Time(++seconds_);
    image->encoding = sensor_msgs::image_encodings::RGBA8;
    image->width = 160;
    image->height = 120;
    image->step = 4 * image->width;
    cv::Mat pixels(120, 160, CV_8UC4);
    cv::theRNG().state = 1;
    cv::randu(pixels, cv::Scalar::all(1), cv::Scalar::all(255));
    cv::GaussianBlur(pixels, pixels, cv::Size(), 2);
    for (int row = 0; row < pixels.rows; ++row) {
      for (int column = 0; column < pixels.cols; ++column)
        pixels.at<cv::Vec4b>(row, column)[3] = column < transparent_columns ? 0 : 255;
    }
    image->data.assign(pixels.datastart, pixels.dataend);
    return tracker_.process(image);
  }

  CameraSource cameras_{false};
  MaskSource masks_;
  LiveTracker tracker_{TrackerOptions(),
                       cameras_,
                       masks_,
                       std::chrono::milliseconds(0),
                       [] { return false; },
                       [this](const std::string&, const std::string& text) { said_ += text; }};
  std::string said_;
  std::uint32_t seconds_ = 0;
};

// Whether there is a tracker yet or not.
TEST_F(LiveTrackerTest, OptionsThatAreRefusedLeaveThoseBeforeInForce) {
  TrackerOptions bad;
  bad.mapping.keyframe_overlap = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(tracker_.set_options(bad), std::invalid_argument);
  EXPECT_NE(answer(), Reason::kInternalError);
  EXPECT_THROW(tracker_.set_options(bad), std::invalid_argument);
  EXPECT_NE(answer(), Reason::kInternalError);
  TrackerOptions good;
  good.max_iterations = 10;
  EXPECT_NO_THROW(tracker_.set_options(good));
  EXPECT_NE(answer(), Reason::kInternalError);
}

TEST_F(LiveTrackerTest, TransparentPixelsAreMasked) {
  const int features = answer_to_cut_out(0).features;
  EXPECT_EQ(said_, "");
  const int unmasked = answer_to_cut_out(120).features;
  answer_to_cut_out(120);
  EXPECT_EQ(said_, "the images have an alpha channel: transparent pixels (alpha 0) are masked") << "once";
  EXPECT_GT(features, 0);
  EXPECT_GT(unmasked, 0);
  EXPECT_LT(2 * unmasked, features);
}

// A driver that computes its calibration for each image does not get the same bits each time.
TEST_F(LiveTrackerTest, ACalibrationThatMovesNoPixelIsNoOther) {
  answer();
  const std::uint32_t epoch = tracker_.epoch();
  for (int i = 1; i < 5; ++i) {
    calibrate(150 + 1e-9 * i);
    answer();
  }
  EXPECT_EQ(tracker_.epoch(), epoch);
  EXPECT_EQ(tracker_.map_version().camera, 1u);
  EXPECT_EQ(said_, "");
  calibrate(152);
  answer();
  EXPECT_EQ(tracker_.epoch(), epoch + 1);
  EXPECT_NE(said_.find("the calibration has changed"), std::string::npos) << said_;
}

}  // namespace

}  // namespace mono_pose_tracker
