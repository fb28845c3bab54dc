#include <gtest/gtest.h>

#include <boost/make_shared.hpp>
#include <functional>
#include <limits>
#include <tuple>

#include "../support/expect_error.h"
#include "../support/temporary_folder.h"
#include "ros/camera_info.h"

namespace mono_pose_tracker {
namespace {

sensor_msgs::CameraInfo calibration() {
  sensor_msgs::CameraInfo info;
  info.width = 640;
  info.height = 480;
  info.distortion_model = "plumb_bob";
  info.D = {0.1, 0.2, 0.3, 0.4, 0.5};
  info.K = {500, 0, 320, 0, 510, 240, 0, 0, 1};
  info.R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.P = {400, 0, 310, 0, 0, 410, 230, 0, 0, 0, 1, 0};
  return info;
}

TEST(CameraInfoConversion, RawImagesHaveKAndD) {
  const ConvertedCamera camera = convert_camera_info(calibration(), false);
  ASSERT_EQ(camera.reason, Reason::kOk) << camera.error;
  EXPECT_EQ(camera.parameters.width, 640);
  EXPECT_DOUBLE_EQ(camera.parameters.fx, 500);
  EXPECT_DOUBLE_EQ(camera.parameters.fy, 510);
  EXPECT_DOUBLE_EQ(camera.parameters.cx, 320);
  EXPECT_DOUBLE_EQ(camera.parameters.cy, 240);
  EXPECT_EQ(camera.parameters.distortion, (std::vector<double>{0.1, 0.2, 0.3, 0.4, 0.5}));
}

TEST(CameraInfoConversion, RectifiedImagesHavePAndNoDistortion) {
  const ConvertedCamera camera = convert_camera_info(calibration(), true);
  EXPECT_DOUBLE_EQ(camera.parameters.fx, 400);
  EXPECT_DOUBLE_EQ(camera.parameters.cy, 230);
  EXPECT_TRUE(camera.parameters.distortion.empty());
}

TEST(CameraInfoConversion, RegionOfInterestAndBinning) {
  sensor_msgs::CameraInfo info = calibration();
  info.roi.x_offset = 100;
  info.roi.y_offset = 60;
  info.roi.width = 400;
  info.roi.height = 300;
  info.binning_x = info.binning_y = 2;
  info.distortion_model = "equidistant";  // unknown to image_geometry, which does the arithmetic
  info.D = {0.1, 0.2, 0.3, 0.4};
  const CameraParameters parameters = convert_camera_info(info, false).parameters;
  EXPECT_EQ(parameters.width, 200);
  EXPECT_EQ(parameters.height, 150);
  EXPECT_DOUBLE_EQ(parameters.fx, 250);
  EXPECT_DOUBLE_EQ(parameters.cx, 110);
  EXPECT_DOUBLE_EQ(parameters.cy, 90);
  EXPECT_EQ(parameters.distortion_model, "equidistant");
}

// A driver that crops, and fills in what it has of the cropped image.
TEST(CameraInfoConversion, ARegionOfInterestBeyondItsImageIsAContradiction) {
  sensor_msgs::CameraInfo info = calibration();
  info.roi.x_offset = 100;
  info.roi.y_offset = 50;
  info.roi.width = 640;
  info.roi.height = 480;
  const ConvertedCamera camera = convert_camera_info(info, false);
  EXPECT_EQ(camera.reason, Reason::kUncalibrated);
  EXPECT_NE(camera.error.find("640x480 at 100, 50 exceeds the image size 640x480"), std::string::npos)
      << camera.error;
  info.roi.x_offset = info.roi.y_offset = 0;
  EXPECT_EQ(convert_camera_info(info, false).reason, Reason::kOk) << "all of the image";
  info.roi.width = info.roi.height = 0;
  info.roi.y_offset = 50;
  const ConvertedCamera empty = convert_camera_info(info, false);
  EXPECT_NE(empty.error.find("0x0 at 0, 50 is empty"), std::string::npos) << empty.error;
}

TEST(CameraInfoConversion, SaysHowTheSizeCameAbout) {
  sensor_msgs::CameraInfo info = calibration();
  EXPECT_EQ(convert_camera_info(info, false).size_origin, "width and height of camera_info");
  info.binning_x = info.binning_y = 2;
  EXPECT_EQ(convert_camera_info(info, false).size_origin,
            "width and height of camera_info, 640x480, binning 2x2");
  info.roi.width = 400;
  info.roi.height = 300;
  EXPECT_NE(
      convert_camera_info(info, false).size_origin.find("region of interest 400x300 at 0, 0, binning 2x2"),
      std::string::npos);
}

TEST(CameraInfoConversion, ThreeModelsAreKnown) {
  sensor_msgs::CameraInfo info = calibration();
  for (const auto& [model, coefficients] :
       {std::pair("plumb_bob", 5), std::pair("rational_polynomial", 8), std::pair("equidistant", 4)}) {
    info.distortion_model = model;
    info.D.assign(static_cast<std::size_t>(coefficients), 0.01);
    const ConvertedCamera camera = convert_camera_info(info, false);
    EXPECT_EQ(camera.reason, Reason::kOk) << camera.error;
    EXPECT_EQ(camera.parameters.distortion_model, model);
    EXPECT_EQ(camera.parameters.distortion, info.D);
  }
  info.distortion_model = "woodscape";
  const ConvertedCamera other = convert_camera_info(info, false);
  EXPECT_EQ(other.reason, Reason::kUncalibrated);
  EXPECT_NE(other.error.find("woodscape"), std::string::npos) << other.error;
}

TEST(CameraSource, AFileCountsWhileNoCalibratedMessageHasCome) {
  const std::chrono::milliseconds at_once(0);
  CameraSource cameras(false);
  EXPECT_FALSE(cameras.wait(at_once));
  cameras.set_file(calibration());
  EXPECT_EQ(cameras.wait(at_once)->parameters.fx, 500);
  EXPECT_FALSE(cameras.is_calibrated_by_message());
  auto message = boost::make_shared<sensor_msgs::CameraInfo>(calibration());
  message->K[0] = 0;
  cameras.set_message(message);
  EXPECT_EQ(cameras.wait(at_once)->parameters.fx, 500) << "the message is not calibrated";
  message = boost::make_shared<sensor_msgs::CameraInfo>(calibration());
  message->K[0] = 600;
  cameras.set_message(message);
  EXPECT_EQ(cameras.wait(at_once)->parameters.fx, 600);
}

TEST(CameraSource, TheFileOrTheTopicAloneCountsWhereThatIsAskedFor) {
  const std::chrono::milliseconds at_once(0);
  auto message = boost::make_shared<sensor_msgs::CameraInfo>(calibration());
  message->K[0] = 600;
  CameraSource by_file(false, 0, "file"), by_topic(false, 0, "topic");
  for (CameraSource* cameras : {&by_file, &by_topic}) cameras->set_file(calibration());
  EXPECT_FALSE(by_topic.wait(at_once));
  for (CameraSource* cameras : {&by_file, &by_topic}) cameras->set_message(message);
  EXPECT_EQ(by_file.wait(at_once)->parameters.fx, 500);
  EXPECT_EQ(by_topic.wait(at_once)->parameters.fx, 600);
}

TEST(CameraInfoConversion, ZeroMatrixIsUncalibrated) {
  sensor_msgs::CameraInfo info;
  info.width = 640;
  info.height = 480;
  const ConvertedCamera camera = convert_camera_info(info, false);
  EXPECT_EQ(camera.reason, Reason::kUncalibrated);
  EXPECT_NE(camera.error.find("camera_info_url"), std::string::npos);
}

// Numbers that no camera has must not throw: the message comes by a callback.
// Some drivers fill in one of the two.
TEST(CameraInfoConversion, TheOtherMatrixIsNamedWhereItHasAFocalLength) {
  sensor_msgs::CameraInfo info = calibration();
  info.K = {};
  const ConvertedCamera raw = convert_camera_info(info, false);
  EXPECT_EQ(raw.reason, Reason::kUncalibrated);
  EXPECT_NE(raw.error.find("but P has. Set rectified to true"), std::string::npos) << raw.error;
  info.P = {};
  EXPECT_NE(convert_camera_info(info, false).error.find("track_sequence: --camera; live: ~camera_info_url"),
            std::string::npos);
}

TEST(CameraInfoConversion, NonsenseIsUncalibrated) {
  const auto expect_refused = [](const std::function<void(sensor_msgs::CameraInfo*)>& change) {
    sensor_msgs::CameraInfo info = calibration();
    change(&info);
    for (const bool rectified : {false, true}) {
      ConvertedCamera camera;
      EXPECT_NO_THROW(camera = convert_camera_info(info, rectified));
      EXPECT_EQ(camera.reason, Reason::kUncalibrated);
      EXPECT_NE(camera.error, "");
    }
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect_refused([](auto* info) { info->width = info->height = 0; });
  expect_refused([](auto* info) { info->width = 0xffffffffu; });
  expect_refused([](auto* info) { info->binning_x = 0xffffffffu; });
  expect_refused([](auto* info) { info->roi.width = info->roi.height = 0xffffffffu; });
  expect_refused([nan](auto* info) { info->K[0] = info->P[0] = nan; });
  expect_refused([nan](auto* info) { info->K[2] = info->P[2] = nan; });
}

// As the reader of calibration files does: what is left out of a camera would be wrong without a sign.
TEST(CameraInfoConversion, AMatrixOfNoSuchCameraIsRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [place, value] :
       {std::pair(1, 5.0), std::pair(1, 50.0), std::pair(1, nan), std::pair(3, -7.0), std::pair(6, 0.001),
        std::pair(7, 1.0), std::pair(8, 2.0), std::pair(8, 0.0)}) {
    sensor_msgs::CameraInfo info = calibration();
    info.K[static_cast<std::size_t>(place)] = value;
    info.P[static_cast<std::size_t>(place + place / 3)] = value;  // 3x4: each row is longer by one
    for (const bool rectified : {false, true}) {
      const ConvertedCamera camera = convert_camera_info(info, rectified);
      EXPECT_EQ(camera.reason, Reason::kUncalibrated) << place << ": " << value;
      EXPECT_NE(camera.error.find("without skew"), std::string::npos) << camera.error;
    }
  }
  sensor_msgs::CameraInfo hardly_skewed = calibration();  // as the fisheye calibration of ROS leaves it
  hardly_skewed.K[1] = hardly_skewed.P[1] = -0.05;
  for (const bool rectified : {false, true}) {
    const ConvertedCamera camera = convert_camera_info(hardly_skewed, rectified);
    EXPECT_EQ(camera.reason, Reason::kOk) << camera.error;
    EXPECT_NE(camera.note.find("skew of -0.05 px"), std::string::npos) << camera.note;
  }
  sensor_msgs::CameraInfo rounded = calibration();
  rounded.K[1] = 9e-4;  // px
  rounded.K[8] = 1 + 1e-9;
  EXPECT_EQ(convert_camera_info(rounded, false).reason, Reason::kOk);
  sensor_msgs::CameraInfo right_of_a_pair = calibration();
  right_of_a_pair.P[3] = -40;
  EXPECT_EQ(convert_camera_info(right_of_a_pair, true).reason, Reason::kOk);
}

// Kalibr's, OpenCV's and others' files are YAML as well.
TEST(CameraInfoConversion, AFileOfAnotherProgramNamesTheMissingKey) {
  TemporaryFolder folder;
  const std::string camera =
      "image_width: 640\nimage_height: 480\ncamera_name: a\ndistortion_model: plumb_bob\n"
      "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n"
      "camera_matrix: {rows: 3, cols: 3, data: [500, 0, 320, 0, 500, 240, 0, 0, 1]}\n"
      "rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n";
  const std::string projection =
      "projection_matrix: {rows: 3, cols: 4, data: [500, 0, 320, 0, 0, 500, 240, 0, 0, 0, 1, 0]}\n";
  EXPECT_EQ(load_camera_info(folder.write("whole.yaml", camera + projection)).width, 640);
  for (const auto& [name, content, missing] :
       {std::tuple("kalibr.yaml", std::string("cam0:\n  intrinsics: [500, 500, 320, 240]\n"), "image_width"),
        std::tuple("part.yaml", camera, "projection_matrix")}) {
    expect_error(
        [&, file = folder.write(name, content)] { load_camera_info(file); },
        {name, std::string("has no key ") + missing, "expected the YAML file that camera_calibration"});
  }
}

TEST(CameraInfoConversion, MissingFileIsNamed) {
  try {
    load_camera_info("/no/such/camera.yaml");
    FAIL() << "a missing file was read";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("/no/such/camera.yaml"), std::string::npos);
  }
}

}  // namespace

}  // namespace mono_pose_tracker
