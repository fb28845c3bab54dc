#include "mono_pose_tracker/io/image_decoding.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace mono_pose_tracker {
namespace {

/// libjpeg fills what a cut file lacks with grey and calls that a success; features on that edge would be
/// nonsense.
bool is_cut_jpeg(const std::vector<unsigned char>& bytes) {
  if (bytes.size() < 4 || bytes[0] != 0xff || bytes[1] != 0xd8) return false;
  const unsigned char end_of_image[] = {0xff, 0xd9};
  return std::find_end(bytes.begin(), bytes.end(), end_of_image, end_of_image + 2) == bytes.end();
}

DecodedImage decode_unchanged(const std::vector<unsigned char>& bytes) {
  if (bytes.empty()) return {{}, "is empty"};
  if (is_cut_jpeg(bytes)) return {{}, "is a JPEG that ends too early"};
  cv::Mat image;
  try {
    image = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);  // unchanged: orientation tags are ignored as well
  } catch (const cv::Exception&) {
    // A header that promises more pixels than OpenCV allows: no image either.
  }
  if (image.empty()) return {{}, "is no image that can be decoded"};
  return {image, {}};
}

DecodedImage read_with(DecodedImage (*decode)(const std::vector<unsigned char>&), const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return {{}, path + ": is a folder"};
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) {
    return {{}, path + ": cannot be read (" + (errno ? std::strerror(errno) : "unknown reason") + ")"};
  }
  DecodedImage decoded = decode({std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()});
  if (!decoded.problem.empty()) decoded.problem = path + ": " + decoded.problem;
  return decoded;
}

}  // namespace

bool has_image_extension(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  static const char* const kExtensions[] = {".png", ".jpg", ".jpeg", ".bmp", ".tif",  ".tiff",
                                            ".pgm", ".ppm", ".pnm",  ".pbm", ".webp", ".jp2"};
  return std::find(std::begin(kExtensions), std::end(kExtensions), extension) != std::end(kExtensions);
}

DecodedImage to_8_bit(const cv::Mat& image) {
  cv::Mat result = image;
  if (image.depth() == CV_16U) {
    image.convertTo(result, CV_8U, 1.0 / 256);  // a fixed factor: grey must not change with the content
  } else if (image.depth() != CV_8U) {
    return {{}, "holds " + cv::typeToString(image.type()) + " pixels: expected 8 or 16 bits a channel"};
  }
  if (result.channels() == 4) {
    cv::cvtColor(result, result, cv::COLOR_BGRA2BGR);
  } else if (result.channels() != 1 && result.channels() != 3) {
    return {{}, "has " + std::to_string(result.channels()) + " channels: expected 1, 3 or 4"};
  }
  return {result, {}};
}

DecodedImage decode_image(const std::vector<unsigned char>& bytes) {
  DecodedImage decoded = decode_unchanged(bytes);
  return decoded.problem.empty() ? to_8_bit(decoded.image) : decoded;
}

DecodedImage read_unchanged(const std::string& path) { return read_with(decode_unchanged, path); }

DecodedImage read_image(const std::string& path) { return read_with(decode_image, path); }

}  // namespace mono_pose_tracker
