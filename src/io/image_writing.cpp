#include "io/image_writing.h"

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <vector>

#include "io/atomic_file.h"
#include "lower_case.h"

namespace mono_pose_tracker {
namespace {

bool encode(const std::string& extension, const cv::Mat& image, std::vector<unsigned char>* bytes) {
  try {
    return cv::imencode(extension, image, *bytes) && !bytes->empty();
  } catch (const cv::Exception&) {  // the format is not for such an image
    return false;
  }
}

// OpenCV makes something else of grey levels in a bitmap, and some of its versions of colours in a graymap.
bool can_hold(const std::string& extension_as_given, const cv::Mat& image) {
  const std::string extension = lower_case(extension_as_given);
  return extension != ".pbm" && (extension != ".pgm" || image.channels() == 1);
}

// Not by cv::imwrite: it says nothing of a disk that is full.
bool write_as(const std::string& extension, const std::string& path, const cv::Mat& image) {
  std::vector<unsigned char> bytes;
  if (!can_hold(extension, image) || !encode(extension, image, &bytes)) return false;
  write_file_atomically(path, [&](std::ostream& out) {
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  });
  return true;
}

}  // namespace

bool write_image_as_named(const std::string& path, const cv::Mat& image) {
  const std::string extension = std::filesystem::path(path).extension().string();
  return !extension.empty() && write_as(extension, path, image);
}

void write_image(const std::string& path, const cv::Mat& image) {
  if (!write_image_as_named(path, image) && !write_as(".png", path, image)) {
    throw std::runtime_error(path + ": cannot be written (the image cannot be encoded)");
  }
}

}  // namespace mono_pose_tracker
