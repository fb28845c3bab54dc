#include "ros/image_conversion.h"

#include <gtest/gtest.h>
#include <sensor_msgs/image_encodings.h>

#include <boost/make_shared.hpp>
#include <functional>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "support/expect_error.h"

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

// Little endian: the second byte of each is what counts.
TEST(ImageConversion, ColoursOfSixteenBits) {
  const std::vector<std::uint8_t> bgr = {0, 10, 0, 20, 0, 30}, rgb = {0, 30, 0, 20, 0, 10};
  const auto with_alpha = [](std::vector<std::uint8_t> pixel) {
    pixel.insert(pixel.end(), {255, 255});
    return pixel;
  };
  expect_bgr("bgr16", bgr, {10, 20, 30});
  expect_bgr("16UC3", bgr, {10, 20, 30});
  expect_bgr("rgb16", rgb, {10, 20, 30});
  expect_bgr("bgra16", with_alpha(bgr), {10, 20, 30});
  expect_bgr("16UC4", with_alpha(bgr), {10, 20, 30});
  expect_bgr("rgba16", with_alpha(rgb), {10, 20, 30});
  expect_bgr("8UC4", {10, 20, 30, 255}, {10, 20, 30});
  sensor_msgs::ImagePtr big_endian = image_of("rgb16", {30, 0, 20, 0, 10, 0});
  big_endian->is_bigendian = 1;
  const ConvertedImage swapped = convert_image(big_endian);
  ASSERT_EQ(swapped.image.type(), CV_8UC3) << swapped.error;
  EXPECT_EQ(swapped.image.at<cv::Vec3b>(1, 1), cv::Vec3b(10, 20, 30));
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

/// A 2x2 image of one colour whose first pixel is transparent.
sensor_msgs::ImagePtr cut_out(const std::string& encoding) {
  const bool has_16_bits = encoding.find("16") == 0 || encoding.find("16", 4) != std::string::npos;
  sensor_msgs::ImagePtr image = image_of(encoding, std::vector<std::uint8_t>(has_16_bits ? 8 : 4, 200));
  std::fill_n(image->data.begin() + (has_16_bits ? 6 : 3), has_16_bits ? 2 : 1, 0);
  return image;
}

TEST(ImageConversion, TransparentPixelsAreInTheMask) {
  for (const char* encoding : {"rgba8", "bgra8", "8UC4", "rgba16", "bgra16", "16UC4"}) {
    const ConvertedImage converted = convert_image(cut_out(encoding));
    ASSERT_EQ(converted.image.type(), CV_8UC3) << encoding << ": " << converted.error;
    ASSERT_EQ(converted.mask.type(), CV_8UC1) << encoding;
    ASSERT_EQ(converted.mask.size(), cv::Size(2, 2)) << encoding;
    EXPECT_EQ(converted.mask.at<std::uint8_t>(0, 0), 0) << encoding;
    EXPECT_EQ(cv::countNonZero(converted.mask), 3) << encoding;
  }
  EXPECT_TRUE(convert_image(image_of("rgba8", {1, 2, 3, 255})).mask.empty()) << "nothing is transparent";
  EXPECT_TRUE(convert_image(image_of("bgra8", {1, 2, 3, 0})).mask.empty()) << "alpha is not used";
  EXPECT_TRUE(convert_image(image_of("bgr8", {1, 2, 3})).mask.empty());
}

TEST(ImageConversion, CompressedImagesKeepTheirAlpha) {
  for (const int type : {CV_8UC4, CV_16UC4}) {
    cv::Mat image(4, 6, type, cv::Scalar(1, 2, 3, 255));
    image.col(0).setTo(cv::Scalar(1, 2, 3, 0));
    sensor_msgs::CompressedImage message;
    cv::imencode(".png", image, message.data);
    const ConvertedImage converted = convert_image(decode_image(message));
    EXPECT_EQ(converted.image.type(), CV_8UC3);
    EXPECT_EQ(cv::countNonZero(converted.mask), 20);
  }
}

TEST(MaskConversion, AlphaDecidesWhereSomeOfItIsTransparent) {
  const ConvertedImage mask = convert_mask(cut_out("rgba8"));
  ASSERT_EQ(mask.image.type(), CV_8UC1) << mask.error;
  EXPECT_EQ(mask.image.at<std::uint8_t>(0, 0), 0);
  EXPECT_EQ(cv::countNonZero(mask.image), 3);
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
  message.format = "h264\n";
  expect_error([&] { decode_image(message); },
               {"cannot be decoded", "its message states the format 'h264?'"});
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

}  // namespace
}  // namespace mono_pose_tracker
