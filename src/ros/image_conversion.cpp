#include "ros/image_conversion.h"

#include <cv_bridge/cv_bridge.h>
#include <sensor_msgs/image_encodings.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <limits>
#include <map>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "common/text.h"
#include "io/image_coding.h"

namespace mono_pose_tracker {
namespace {

namespace enc = sensor_msgs::image_encodings;

constexpr const char* kKnownEncodings =
    "mono8, mono16, 8UC1, 16UC1, 8UC3, 8UC4, 16UC3, 16UC4, rgb8, bgr8, rgba8, bgra8, rgb16, bgr16, rgba16, "
    "bgra16, "
    "bayer_*8, bayer_*16 and yuv422 (UYVY and YUY2)";

const char* const kYuy2 = "yuv422_yuy2";  // which sensor_msgs of Noetic does not know

/// Makes an encoding printable: it is arbitrary text from outside, and exception texts may have line ends.
/// Status and log need one line of plain letters of limited length.
std::string short_ascii_line(std::string text) {
  constexpr std::size_t kMostLetters = 400;
  if (text.size() > kMostLetters) text.replace(kMostLetters, std::string::npos, "...");
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

ConvertedImage refuse(Reason reason, const std::string& error) {
  return {cv::Mat(), reason, short_ascii_line(error), nullptr};
}

bool is_16bit_bayer(const std::string& encoding) {
  return enc::isBayer(encoding) && enc::bitDepth(encoding) == 16;
}

/// Of 16 bits a channel, but for the bayer patterns.
bool is_16bit(const std::string& encoding) {
  const std::initializer_list<std::string> known = {enc::MONO16,     enc::TYPE_16UC1, enc::TYPE_16UC3,
                                                    enc::TYPE_16UC4, enc::RGB16,      enc::BGR16,
                                                    enc::RGBA16,     enc::BGRA16};
  return std::find(known.begin(), known.end(), encoding) != known.end();
}

/// The encoding cv_bridge shall convert to; empty: the pixels are taken as they are.
std::string target_encoding(const std::string& encoding) {
  if (encoding == enc::MONO8 || encoding == enc::TYPE_8UC1 || encoding == enc::BGR8 ||
      encoding == enc::TYPE_8UC3 || encoding == enc::TYPE_8UC4 || encoding == enc::RGBA8 ||
      encoding == enc::BGRA8 || is_16bit(encoding) || is_16bit_bayer(encoding)) {
    return "";
  }
  return enc::BGR8;
}

bool is_known(const std::string& encoding) {
  return target_encoding(encoding).empty() || encoding == enc::RGB8 || encoding == enc::YUV422 ||
         encoding == kYuy2 || enc::isBayer(encoding);
}

std::uint64_t bytes_per_pixel(const std::string& encoding) {
  if (encoding == kYuy2) return 2;
  return static_cast<std::uint64_t>(enc::numChannels(encoding)) *
         static_cast<std::uint64_t>(enc::bitDepth(encoding)) / 8;
}

/// Whether a message has as many bytes as its fields state. The only place where these are multiplied, in 64
/// bits, where products of 32-bit fields cannot overflow.
bool is_complete(const sensor_msgs::Image& image) {
  constexpr std::uint64_t kMost = std::numeric_limits<int>::max();  // of cv::Mat's sides
  const std::uint64_t width = image.width, height = image.height, step = image.step;
  return width > 0 && width <= kMost && height > 0 && height <= kMost &&
         step >= width * bytes_per_pixel(image.encoding) && image.data.size() >= step * height;
}

std::string describe(const sensor_msgs::Image& image) {
  return std::to_string(image.width) + "x" + std::to_string(image.height) + ", step " +
         std::to_string(image.step) + ", encoding \"" + image.encoding + "\", " +
         std::to_string(image.data.size()) + " bytes";
}

/// cv_bridge of Noetic does not know YUY2, the order that most USB cameras send.
cv::Mat yuy2_to_bgr(const sensor_msgs::Image& image) {
  const cv::Mat yuy2(static_cast<int>(image.height), static_cast<int>(image.width), CV_8UC2,
                     const_cast<std::uint8_t*>(image.data.data()), image.step);
  cv::Mat bgr;
  cv::cvtColor(yuy2, bgr, cv::COLOR_YUV2BGR_YUY2);
  return bgr;
}

/// cv_bridge takes the patterns of 16 bits as they are only. OpenCV names a pattern by its second row.
cv::Mat demosaic(const cv::Mat& bayer, const std::string& encoding) {
  int code = cv::COLOR_BayerBG2BGR;  // bayer_rggb16
  if (encoding == enc::BAYER_BGGR16) code = cv::COLOR_BayerRG2BGR;
  if (encoding == enc::BAYER_GBRG16) code = cv::COLOR_BayerGR2BGR;
  if (encoding == enc::BAYER_GRBG16) code = cv::COLOR_BayerGB2BGR;
  cv::Mat bgr;
  cv::cvtColor(bayer, bgr, code);
  return bgr;
}

/// cv_bridge swaps the bytes of a big-endian image, and calls them two channels each.
cv::Mat as_16bit(const cv::Mat& image, const sensor_msgs::Image& message) {
  if (image.depth() != CV_8U || enc::bitDepth(message.encoding) != 16) return image;
  return cv::Mat(image.rows, static_cast<int>(message.width), CV_16UC(enc::numChannels(message.encoding)),
                 image.data, image.step)
      .clone();
}

/// Of what was taken as it is: blue, green, red, without alpha.
cv::Mat in_bgr(const cv::Mat& image, const std::string& encoding) {
  int code = -1;
  if (encoding == enc::RGB16) code = cv::COLOR_RGB2BGR;
  if (encoding == enc::RGBA8 || encoding == enc::RGBA16) code = cv::COLOR_RGBA2BGR;
  if (encoding == enc::BGRA8 || encoding == enc::TYPE_8UC4 || encoding == enc::BGRA16 ||
      encoding == enc::TYPE_16UC4) {
    code = cv::COLOR_BGRA2BGR;
  }
  if (code < 0) return image;
  cv::Mat bgr;
  cv::cvtColor(image, bgr, code);
  return bgr;
}

/// finish: makes an image for the tracker of pixels with all their bits (8 or 16) and one or three channels.
ConvertedImage convert(const sensor_msgs::ImageConstPtr& message,
                       const std::function<cv::Mat(const cv::Mat&)>& finish) {
  if (!is_known(message->encoding)) {
    return refuse(Reason::kUnsupportedEncoding,
                  "encoding \"" + message->encoding + "\" is not supported (known: " + kKnownEncodings + ")");
  }
  if (!is_complete(*message)) {
    return refuse(Reason::kUnreadableImage, "the image message is inconsistent: " + describe(*message));
  }
  // OpenCV takes the pixels by twos, and does not look whether the last has another one.
  if ((message->encoding == kYuy2 || message->encoding == enc::YUV422) && message->width % 2 != 0) {
    return refuse(
        Reason::kUnreadableImage,
        "the width is odd, but two pixels share their colour in this encoding: " + describe(*message));
  }
  try {
    if (message->encoding == kYuy2) return {finish(yuy2_to_bgr(*message)), Reason::kOk, "", message};
    const cv::Mat pixels =
        as_16bit(cv_bridge::toCvShare(message, target_encoding(message->encoding))->image, *message);
    if (is_16bit_bayer(message->encoding)) {
      return {finish(demosaic(pixels, message->encoding)), Reason::kOk, "", message};
    }
    return {finish(in_bgr(pixels, message->encoding)), Reason::kOk, "", message, mask_of_alpha(pixels)};
  } catch (const std::exception& e) {
    return refuse(Reason::kUnreadableImage, describe(*message) + ": " + e.what());
  }
}

}  // namespace

ConvertedImage convert_image(const sensor_msgs::ImageConstPtr& message, const GreyLevels& levels) {
  return convert(message, [&](const cv::Mat& image) {
    return image.depth() == CV_8U ? image : to_8_bit(image, levels).image;
  });
}

ConvertedImage convert_with_all_bits(const sensor_msgs::ImageConstPtr& message) {
  return convert(message, [](const cv::Mat& image) { return image; });
}

ConvertedImage convert_mask(const sensor_msgs::ImageConstPtr& message) {
  ConvertedImage converted = convert(message, mask_of_image);
  if (!converted.mask.empty()) converted.image = converted.mask;
  return converted;
}

std::string with_format(const std::string& problem, const std::string& format) {
  constexpr std::size_t kMost = 40;  // characters quoted
  if (problem.empty() || format.empty()) return problem;
  return problem + "; its message states the format '" + one_line(format.substr(0, kMost)) + "'";
}

sensor_msgs::ImagePtr decode_image(const sensor_msgs::CompressedImage& message, std::uint64_t max_pixels) {
  static const std::map<int, std::string> encodings = {{CV_8UC1, enc::MONO8},  {CV_8UC3, enc::BGR8},
                                                       {CV_8UC4, enc::BGRA8},  {CV_16UC1, enc::MONO16},
                                                       {CV_16UC3, enc::BGR16}, {CV_16UC4, enc::BGRA16}};
  DecodedImage decoded = decode_unchanged(message.data, max_pixels);
  const auto encoding = encodings.find(decoded.image.type());
  if (decoded.problem.empty() && encoding == encodings.end())
    decoded.problem = to_8_bit(decoded.image).problem;
  if (!decoded.problem.empty()) {
    throw std::runtime_error("the compressed image " + with_format(decoded.problem, message.format));
  }
  return cv_bridge::CvImage(message.header, encoding->second, decoded.image).toImageMsg();
}

}  // namespace mono_pose_tracker
