#include "io/image_decoding.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "common/text.h"
#include "io/image_header.h"
#include "jpeg_data.h"
#include "lower_case.h"
#include "read_whole.h"

namespace mono_pose_tracker {
namespace {

// No image that may be decoded has a larger file: 100 megapixels of 8 bytes, not compressed.
constexpr std::uintmax_t kMaxFileBytes = std::uintmax_t{1} << 30;

std::string problem_of_size(const std::vector<unsigned char>& bytes, std::uint64_t max_pixels) {
  const ImageHeader header = read_image_header(bytes);
  if (!header.problem.empty()) return header.problem;
  if (header.height <= max_pixels / header.width) return "";
  return "is " + std::to_string(header.width) + " x " + std::to_string(header.height) +
         ": expected at most " + std::to_string(max_pixels) + " pixels";
}

// libjpeg fills what a file lacks with grey and calls that a success, and OpenCV takes it.
DecodedImage decode_jpeg(const std::vector<unsigned char>& bytes) {
  JpegData data;
  data.end_early = !has_end_of_jpeg(bytes);
  if (!data.end_early) data = read_jpeg_data(bytes);
  if (data.end_early) return {{}, "is a JPEG that ends too early"};
  return {data.image, {}};
}

// Error of reading the file; nothing if it was read.
std::string read_bytes(const std::string& path, std::vector<unsigned char>* bytes) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return "is a folder";
  if (std::filesystem::exists(path, error) && !std::filesystem::is_regular_file(path, error)) {
    return "is not a regular file";  // a device could be read for ever
  }
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (!error && size > kMaxFileBytes) {
    return "has " + std::to_string(size) + " bytes: expected at most " + std::to_string(kMaxFileBytes);
  }
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) return "cannot be read (" + system_error_text() + ")";
  if (!error) bytes->reserve(size);
  return read_whole(stream, kMaxFileBytes, bytes) ? "" : "has too many bytes";
}

DecodedImage read_with(const std::function<DecodedImage(const std::vector<unsigned char>&)>& decode,
                       const std::string& path) {
  std::vector<unsigned char> bytes;
  DecodedImage decoded;
  decoded.problem = read_bytes(path, &bytes);
  if (decoded.problem.empty()) decoded = decode(bytes);
  if (!decoded.problem.empty()) decoded.problem = path + ": " + decoded.problem;
  return decoded;
}

}  // namespace

bool has_image_extension(const std::string& path) {
  const std::string extension = lower_case(std::filesystem::path(path).extension().string());
  static const char* const kExtensions[] = {".png", ".jpg", ".jpeg", ".bmp", ".tif",  ".tiff",
                                            ".pgm", ".ppm", ".pnm",  ".pbm", ".webp", ".jp2"};
  return std::find(std::begin(kExtensions), std::end(kExtensions), extension) != std::end(kExtensions);
}

namespace {

/// Of an image with four channels. What draws nothing at all has no use for alpha, and fills in zeros.
cv::Mat mask_of_alpha(const cv::Mat& image) {
  if (image.channels() != 4) return {};
  cv::Mat alpha;
  cv::extractChannel(image, alpha, 3);
  const int seen = cv::countNonZero(alpha);
  return seen == 0 || seen == static_cast<int>(alpha.total()) ? cv::Mat() : cv::Mat(alpha != 0);
}

}  // namespace

DecodedImage to_8_bit(const cv::Mat& image, const GreyLevels& levels) {
  cv::Mat result = image;
  if (image.depth() == CV_16U) {
    const double factor = 256 / (levels.white - levels.black);
    image.convertTo(result, CV_8U, factor, -levels.black * factor);
  } else if (image.depth() != CV_8U) {
    return {{}, "holds " + cv::typeToString(image.type()) + " pixels: expected 8 or 16 bits per channel"};
  }
  if (result.channels() == 4) {
    cv::cvtColor(result, result, cv::COLOR_BGRA2BGR);
  } else if (result.channels() != 1 && result.channels() != 3) {
    return {{}, "has " + std::to_string(result.channels()) + " channels: expected 1, 3 or 4"};
  }
  return {result, {}, mask_of_alpha(image)};
}

DecodedImage decode_unchanged(const std::vector<unsigned char>& bytes, std::uint64_t max_pixels) {
  const std::string problem = problem_of_size(bytes, max_pixels);
  if (!problem.empty()) return {{}, problem};
  DecodedImage decoded;
  try {
    if (is_jpeg(bytes)) decoded = decode_jpeg(bytes);
    if (!decoded.problem.empty() || !decoded.image.empty()) return decoded;
    decoded.image =
        cv::imdecode(bytes, cv::IMREAD_UNCHANGED);  // unchanged: orientation tags are ignored as well
  } catch (const std::exception&) {
    // What the decoder can't make sense of, or finds no memory for, is no image either.
  }
  if (decoded.image.empty()) return {{}, "cannot be decoded as an image"};
  return decoded;
}

DecodedImage decode_image(const std::vector<unsigned char>& bytes, std::uint64_t max_pixels,
                          const GreyLevels& levels) {
  DecodedImage decoded = decode_unchanged(bytes, max_pixels);
  if (!decoded.problem.empty()) return decoded;
  try {
    return to_8_bit(decoded.image, levels);
  } catch (const std::exception&) {
    return {{}, "needs more memory than is available"};
  }
}

DecodedImage read_unchanged(const std::string& path) {
  return read_with([](const auto& bytes) { return decode_unchanged(bytes); }, path);
}

DecodedImage read_image(const std::string& path, const GreyLevels& levels) {
  return read_with([&](const auto& bytes) { return decode_image(bytes, kMaxImagePixels, levels); }, path);
}

}  // namespace mono_pose_tracker
