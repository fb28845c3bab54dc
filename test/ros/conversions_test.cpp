#include <gtest/gtest.h>
#include <sensor_msgs/image_encodings.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <boost/make_shared.hpp>
#include <functional>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "mono_pose_tracker/ros/camera_info_conversion.h"
#include "mono_pose_tracker/ros/camera_source.h"
#include "mono_pose_tracker/ros/image_conversion.h"
#include "mono_pose_tracker/ros/messages.h"

namespace mono_pose_tracker {
namespace {

/// A 2x2 image of one colour.
sensor_msgs::ImagePtr image_of(const std::string& encoding, const std::vector<std::uint8_t>& pixel) {
  auto image = boost::make_shared<sensor_msgs::Image>();
  image->width = image->height = 2;
  image->encoding = encoding;
  image->step = static_cast<std::uint32_t>(2 * pixel.size());
  for (int i = 0; i < 4; ++i) image->data.insert(image->data.end(), pixel.begin(), pixel.end());
  return image;
}

void expect_bgr(const std::string& encoding, const std::vector<std::uint8_t>& pixel, const cv::Vec3b& bgr) {
  const ConvertedImage converted = convert_image(image_of(encoding, pixel));
  ASSERT_EQ(converted.reason, Reason::kOk) << encoding << ": " << converted.error;
  ASSERT_EQ(converted.image.type(), CV_8UC3) << encoding;
  EXPECT_EQ(converted.image.at<cv::Vec3b>(1, 1), bgr) << encoding;
}

TEST(ImageConversion, ColoursComeOutBlueGreenRed) {
  expect_bgr("bgr8", {10, 20, 30}, {10, 20, 30});
  expect_bgr("8UC3", {10, 20, 30}, {10, 20, 30});
  expect_bgr("rgb8", {30, 20, 10}, {10, 20, 30});
  expect_bgr("rgba8", {30, 20, 10, 255}, {10, 20, 30});
  expect_bgr("bgra8", {10, 20, 30, 255}, {10, 20, 30});
}

TEST(ImageConversion, YuvOrdersAreTold) {
  const ConvertedImage uyvy = convert_image(image_of("yuv422", {128, 235}));       // u and y, white
  const ConvertedImage yuy2 = convert_image(image_of("yuv422_yuy2", {235, 128}));  // y and u, white
  EXPECT_EQ(uyvy.image.at<cv::Vec3b>(0, 0), cv::Vec3b(255, 255, 255));
  EXPECT_EQ(yuy2.image.at<cv::Vec3b>(0, 0), cv::Vec3b(255, 255, 255));
}

TEST(ImageConversion, GreyStaysGreyAndSixteenBitsAreDividedBy256) {
  for (const char* encoding : {"mono8", "8UC1"}) {
    const ConvertedImage converted = convert_image(image_of(encoding, {77}));
    ASSERT_EQ(converted.image.type(), CV_8UC1);
    EXPECT_EQ(converted.image.at<std::uint8_t>(1, 1), 77);
  }
  for (const char* encoding : {"mono16", "16UC1"}) {
    const ConvertedImage converted = convert_image(image_of(encoding, {0, 100}));  // little endian 25600
    ASSERT_EQ(converted.image.type(), CV_8UC1);
    EXPECT_EQ(converted.image.at<std::uint8_t>(1, 1), 100);
    sensor_msgs::ImagePtr big_endian = image_of(encoding, {100, 0});
    big_endian->is_bigendian = 1;
    const ConvertedImage swapped = convert_image(big_endian);
    ASSERT_EQ(swapped.image.type(), CV_8UC1) << swapped.error;
    EXPECT_EQ(swapped.image.at<std::uint8_t>(1, 1), 100);
  }
}

// Red, green or blue alone lights up: after demosaicing its channel is the brightest in the middle of the
// image.
TEST(ImageConversion, BayerPatternsGiveTheirColours) {
  const int size = 8;
  for (const std::string pattern : {"rggb", "bggr", "gbrg", "grbg"}) {
    for (const int bytes : {1, 2}) {
      for (int channel = 0; channel < 3; ++channel) {  // blue, green, red
        auto image = boost::make_shared<sensor_msgs::Image>();
        image->width = image->height = size;
        image->encoding = "bayer_" + pattern + (bytes == 1 ? "8" : "16");
        image->step = size * bytes;
        for (int y = 0; y < size; ++y) {
          for (int x = 0; x < size; ++x) {
            const bool lit = pattern[2 * (y % 2) + x % 2] == "bgr"[channel];
            if (bytes == 2) image->data.push_back(0);  // little endian
            image->data.push_back(lit ? 200 : 0);
          }
        }
        const ConvertedImage converted = convert_image(image);
        ASSERT_EQ(converted.reason, Reason::kOk) << image->encoding << ": " << converted.error;
        ASSERT_EQ(converted.image.type(), CV_8UC3) << image->encoding;
        const cv::Vec3b middle = converted.image.at<cv::Vec3b>(3, 3);
        EXPECT_EQ(middle[channel], 200) << image->encoding << ", channel " << channel;
        EXPECT_EQ(middle[(channel + 1) % 3], 0) << image->encoding << ", channel " << channel;
      }
    }
  }
}

TEST(ImageConversion, BigEndianIsTold) {
  sensor_msgs::ImagePtr image = image_of("mono16", {100, 0});
  image->is_bigendian = true;
  EXPECT_EQ(convert_image(image).image.at<std::uint8_t>(1, 1), 100);
}

TEST(ImageConversion, UnknownEncodingIsNamed) {
  const ConvertedImage converted = convert_image(image_of("32FC1", {0, 0, 0, 0}));
  EXPECT_EQ(converted.reason, Reason::kUnsupportedEncoding);
  EXPECT_NE(converted.error.find("32FC1"), std::string::npos);
}

// A label of an object is as good as 255, whatever it is and however many bits it has.
TEST(MaskConversion, WhateverIsNotZeroIsUsed) {
  const std::vector<std::pair<std::string, std::vector<std::uint8_t>>> used = {
      {"mono8", {1}},          {"8UC1", {255}},      {"mono16", {1, 0}},  {"16UC1", {1, 0}},
      {"mono16", {0, 1}},      {"bgr8", {1, 0, 0}},  {"rgb8", {0, 0, 1}}, {"8UC3", {0, 1, 0}},
      {"rgba8", {1, 0, 0, 0}}, {"16UC1", {255, 255}}};
  for (const auto& [encoding, pixel] : used) {
    const ConvertedImage mask = convert_mask(image_of(encoding, pixel));
    ASSERT_EQ(mask.image.type(), CV_8UC1) << encoding << ": " << mask.error;
    EXPECT_EQ(cv::countNonZero(mask.image), 4) << encoding;
  }
  sensor_msgs::ImagePtr big_endian = image_of("mono16", {0, 1});
  big_endian->is_bigendian = 1;
  EXPECT_EQ(cv::countNonZero(convert_mask(big_endian).image), 4);
}

TEST(MaskConversion, ZeroIsIgnored) {
  const std::vector<std::pair<std::string, std::vector<std::uint8_t>>> ignored = {
      {"mono8", {0}}, {"16UC1", {0, 0}}, {"bgr8", {0, 0, 0}}, {"bgra8", {0, 0, 0, 255}}};
  for (const auto& [encoding, pixel] : ignored) {
    const ConvertedImage mask = convert_mask(image_of(encoding, pixel));
    ASSERT_EQ(mask.image.type(), CV_8UC1) << encoding << ": " << mask.error;
    EXPECT_EQ(cv::countNonZero(mask.image), 0) << encoding;
  }
}

TEST(ImageConversion, PixelsThatShareAColourComeByTwos) {
  for (const char* encoding : {"yuv422", "yuv422_yuy2"}) {
    sensor_msgs::ImagePtr image = image_of(encoding, {128, 128});
    image->width = 7;
    image->height = 5;
    image->step = 14;
    image->data.assign(14 * 5, 128);
    const ConvertedImage odd = convert_image(image);
    EXPECT_EQ(odd.reason, Reason::kUnreadableImage) << encoding;
    EXPECT_NE(odd.error.find("7x5"), std::string::npos) << odd.error;
    image->width = 6;
    EXPECT_EQ(convert_image(image).reason, Reason::kOk) << encoding;
  }
}

// It goes into statuses, diagnostics and logs, some of which take a line for a message and UTF-8 for text.
TEST(ImageConversion, AnEncodingThatIsNoNameStaysOneShortLine) {
  sensor_msgs::ImagePtr image = image_of("mono8", {0});
  image->encoding = "a\nb\xff" + std::string(100000, 'x');
  const std::string error = convert_image(image).error;
  EXPECT_NE(error.find("\"a?b?xxx"), std::string::npos) << error;
  EXPECT_LT(error.size(), 500u);
  EXPECT_EQ(error.find('\n'), std::string::npos);
}

TEST(ImageConversion, AMessageThatContradictsItselfIsRefused) {
  for (const char* encoding : {"mono8", "bgr8", "yuv422_yuy2"}) {
    sensor_msgs::ImagePtr image = image_of(encoding, std::vector<std::uint8_t>(3, 0));
    image->data.pop_back();
    EXPECT_EQ(convert_image(image).reason, Reason::kUnreadableImage) << encoding;
    image->step = 0;
    EXPECT_EQ(convert_image(image).reason, Reason::kUnreadableImage) << encoding;
    image->data.clear();
    image->width = image->height = 0;
    EXPECT_EQ(convert_image(image).reason, Reason::kUnreadableImage) << encoding;
  }
}

// In 32 bits each of these products wraps to less than the hundred bytes that there are.
TEST(ImageConversion, SizesWhoseProductsWrapAreRefused) {
  struct Size {
    const char* encoding;
    std::uint32_t width, height, step;
  };
  constexpr std::uint32_t kHalf = 1u << 31;
  for (const Size& size : {Size{"yuv422_yuy2", 640, 2, kHalf},
                           {"yuv422_yuy2", kHalf, 1, 0},
                           {"mono8", 4, 2, kHalf},
                           {"yuv422", kHalf, 1, 8},
                           {"rgba8", 1u << 30, 1, 16},
                           {"mono16", kHalf, 1, 100},
                           {"bayer_rggb8", 10, kHalf, 10},
                           {"bgr8", 1, 0xffffffffu, 0xffffffffu},
                           {"mono8", 1, kHalf, 0}}) {
    auto image = boost::make_shared<sensor_msgs::Image>();
    image->encoding = size.encoding;
    image->width = size.width;
    image->height = size.height;
    image->step = size.step;
    image->data.resize(100);
    EXPECT_EQ(convert_image(image).reason, Reason::kUnreadableImage)
        << size.encoding << " " << size.width << "x" << size.height << ", step " << size.step;
    EXPECT_TRUE(convert_mask(image).image.empty());
  }
}

TEST(ImageConversion, CompressedImagesAreDecoded) {
  sensor_msgs::CompressedImage message;
  message.header.stamp = ros::Time(3, 4);
  cv::imencode(".png", cv::Mat(4, 6, CV_8UC3, cv::Scalar(1, 2, 3)), message.data);
  const sensor_msgs::ImagePtr image = decode_image(message);
  EXPECT_EQ(image->header.stamp, message.header.stamp);
  EXPECT_EQ(image->encoding, "bgr8");
  EXPECT_EQ(convert_image(image).image.at<cv::Vec3b>(3, 5), cv::Vec3b(1, 2, 3));
  EXPECT_THROW(decode_image(message, 23), std::runtime_error) << "it has 24 pixels";
  message.data.resize(10);
  EXPECT_THROW(decode_image(message), std::runtime_error);
}

// What libjpeg completes with grey, and calls a success.
TEST(ImageConversion, ACutJpegIsNoImage) {
  sensor_msgs::CompressedImage message;
  cv::Mat noise(200, 300, CV_8UC1);
  cv::randu(noise, 0, 255);
  cv::imencode(".jpg", noise, message.data);
  EXPECT_EQ(decode_image(message)->width, 300u);
  message.data.resize(message.data.size() / 2);
  EXPECT_THROW(decode_image(message), std::runtime_error);
}

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

TEST(CameraInfoConversion, ZeroMatrixIsUncalibrated) {
  sensor_msgs::CameraInfo info;
  info.width = 640;
  info.height = 480;
  const ConvertedCamera camera = convert_camera_info(info, false);
  EXPECT_EQ(camera.reason, Reason::kUncalibrated);
  EXPECT_NE(camera.error.find("camera_info_url"), std::string::npos);
}

// Numbers that no camera has must not throw: the message comes by a callback.
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
  sensor_msgs::CameraInfo rounded = calibration();
  rounded.K[1] = 9e-4;  // px
  rounded.K[8] = 1 + 1e-9;
  EXPECT_EQ(convert_camera_info(rounded, false).reason, Reason::kOk);
  sensor_msgs::CameraInfo right_of_a_pair = calibration();
  right_of_a_pair.P[3] = -40;
  EXPECT_EQ(convert_camera_info(right_of_a_pair, true).reason, Reason::kOk);
}

TEST(CameraInfoConversion, MissingFileIsNamed) {
  try {
    load_camera_info("/no/such/camera.yaml");
    FAIL() << "a missing file was read";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("/no/such/camera.yaml"), std::string::npos);
  }
}

// With ~tf_tolerance a stamp may lie behind the last that there is; roscpp's own sum throws there.
TEST(Messages, ALaterStampIsNoneBehindTheLastOne) {
  EXPECT_EQ(*later(ros::Time(10, 900000000), 200000000), ros::Time(11, 100000000));
  EXPECT_EQ(*later(ros::Time(10, 0), -1), ros::Time(9, 999999999));
  EXPECT_EQ(*later(ros::TIME_MAX - ros::Duration(0, 1), 1), ros::TIME_MAX);
  EXPECT_FALSE(later(ros::TIME_MAX, 1));
  EXPECT_FALSE(later(ros::TIME_MAX, static_cast<std::int64_t>(ros::TIME_MAX.toNSec())));
  EXPECT_FALSE(later(ros::Time(0, 0), -1));
}

TEST(Messages, TransformMapsTheChildIntoTheParent) {
  const Rigid3 map_from_camera(Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY())),
                               {1, 2, 3});
  std_msgs::Header header;
  header.frame_id = "map";
  const geometry_msgs::TransformStamped transform = to_transform(header, "camera", map_from_camera);
  EXPECT_EQ(transform.header.frame_id, "map");
  EXPECT_EQ(transform.child_frame_id, "camera");
  EXPECT_DOUBLE_EQ(transform.transform.translation.y, 2);
  EXPECT_DOUBLE_EQ(transform.transform.rotation.y, std::sin(0.25));
}

TEST(Messages, CovarianceIsRowMajor) {
  Matrix6d covariance = Matrix6d::Zero();
  covariance(0, 5) = 7;
  EXPECT_DOUBLE_EQ(to_pose_with_covariance({Rigid3(), covariance}).covariance[5], 7);
}

TEST(Messages, TwistIsInTheChildsFrame) {
  // Seen from the map the camera moves along x; it looks along x, so in its own frame it moves along z.
  const Eigen::Quaterniond looks_along_x(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY()));
  StampedEstimate before, after;
  before.parent_from_child.b_from_a = Rigid3(looks_along_x, Eigen::Vector3d(0, 0, 0));
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ()));
  after.parent_from_child.b_from_a = Rigid3(looks_along_x * turned, Eigen::Vector3d(1, 0, 0));
  after.stamp_ns = 500000000;
  const geometry_msgs::TwistWithCovariance twist = to_twist(before, after);
  EXPECT_NEAR(twist.twist.linear.z, 2, 1e-9);
  EXPECT_NEAR(twist.twist.linear.x, 0, 1e-9);
  EXPECT_NEAR(twist.twist.angular.z, 0.4, 1e-9);
}

TEST(Messages, CloudHoldsPositionsAndColours) {
  ColoredPoint point;
  point.x_in_map = {1, 2, 3};
  point.r = 10;
  point.g = 20;
  point.b = 30;
  const sensor_msgs::PointCloud2 none = to_point_cloud(std_msgs::Header(), {});
  EXPECT_EQ(none.width * none.height, 0u);
  EXPECT_EQ(none.fields.size(), 4u) << "x y z rgb, as with points";
  const sensor_msgs::PointCloud2 cloud = to_point_cloud(std_msgs::Header(), {point, point});
  ASSERT_EQ(cloud.width * cloud.height, 2u);
  sensor_msgs::PointCloud2ConstIterator<float> x(cloud, "x");
  sensor_msgs::PointCloud2ConstIterator<std::uint8_t> r(cloud, "r"), g(cloud, "g"), b(cloud, "b");
  EXPECT_EQ((x + 1)[2], 3.0f);
  EXPECT_EQ((r + 1)[0], 10);
  EXPECT_EQ((g + 1)[0], 20);
  EXPECT_EQ((b + 1)[0], 30);
}

TEST(Messages, StatusNamesItsCodes) {
  FrameReport report;
  report.state = State::kLost;
  report.reason = Reason::kTooFewMatches;
  report.stages = {{"features", 12.5}};
  const TrackerStatus status = to_status(report);
  EXPECT_EQ(status.state, TrackerStatus::LOST);
  EXPECT_EQ(status.state_name, "LOST");
  EXPECT_EQ(status.reason, TrackerStatus::TOO_FEW_MATCHES);
  EXPECT_EQ(status.reason_name, "TOO_FEW_MATCHES");
  EXPECT_EQ(status.stage_names.at(0), "features");
  EXPECT_FLOAT_EQ(status.stage_ms.at(0), 12.5f);
}

/// The numbers of the enumerations are those of the message.
TEST(Messages, CodesAgree) {
  EXPECT_EQ(static_cast<int>(State::kPaused), TrackerStatus::PAUSED);
  EXPECT_EQ(static_cast<int>(Reason::kDropped), TrackerStatus::DROPPED);
  EXPECT_EQ(static_cast<int>(Reason::kRelocalising), TrackerStatus::RELOCALISING);
  EXPECT_EQ(static_cast<int>(ScaleSource::kKnownBaseline), TrackerStatus::KNOWN_BASELINE);
  EXPECT_EQ(static_cast<int>(ScaleSource::kInitialMedianDepth), TrackerStatus::INITIAL_MEDIAN_DEPTH);
  EXPECT_EQ(static_cast<int>(ScaleSource::kMarker), TrackerStatus::MARKER);
  EXPECT_EQ(static_cast<int>(ScaleSource::kOdometry), TrackerStatus::ODOMETRY);
  EXPECT_EQ(static_cast<int>(CalibrationSource::kGuessed), TrackerStatus::GUESSED);
  EXPECT_EQ(static_cast<int>(CalibrationSource::kRefined), TrackerStatus::REFINED);
  EXPECT_EQ(static_cast<int>(Reason::kNotRigid), TrackerStatus::NOT_RIGID);
  EXPECT_EQ(static_cast<int>(Reason::kPaused), TrackerStatus::REASON_PAUSED);
  EXPECT_EQ(static_cast<int>(Reason::kInternalError), TrackerStatus::INTERNAL_ERROR);
}

}  // namespace
}  // namespace mono_pose_tracker
