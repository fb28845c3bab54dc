#include "ros/live_tracker.h"

#include <gtest/gtest.h>
#include <sensor_msgs/image_encodings.h>

#include <boost/make_shared.hpp>
#include <limits>

#include "ros/camera_info.h"

namespace mono_pose_tracker {
namespace {

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
