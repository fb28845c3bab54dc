#include "camera/camera_parameters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "common/rotation.h"
#include "common/text.h"

namespace mono_pose_tracker {

CameraParameters guess_camera(int width_px, int height_px, double hfov_deg) {
  if (!(hfov_deg >= kMinHfovDeg && hfov_deg <= kMaxHfovDeg)) {
    std::ostringstream text;
    text << "hfov is " << hfov_deg << ", expected " << kMinHfovDeg << " to " << kMaxHfovDeg << " degrees";
    throw std::invalid_argument(text.str());
  }
  if (width_px <= 0 || height_px <= 0)
    throw std::invalid_argument("the image size is zero: expected a positive width and height");
  CameraParameters camera;
  camera.width = width_px;
  camera.height = height_px;
  camera.fx = camera.fy = 0.5 * width_px / std::tan(0.5 * hfov_deg * kDegree);
  // The centre of the first pixel is (0, 0).
  camera.cx = 0.5 * (width_px - 1);
  camera.cy = 0.5 * (height_px - 1);
  camera.distortion_model.clear();
  return camera;
}

namespace {

/// Skew moves the pixels of a row sideways, in proportion to the row's distance from that of the centre.
double largest_skew_shift_px(const std::array<double, 9>& matrix, int height_px) {
  const double skew = matrix[1], fy = matrix[4], cy = matrix[5];
  return std::abs(skew / fy) * std::max(std::abs(cy), std::abs(height_px - 1 - cy));
}

}  // namespace

std::string require_camera_matrix(const std::array<double, 9>& matrix, int height_px) {
  // The last row divides pixels, of which there are as many as the focal length is long.
  const double divided = kCalibrationRoundingPx / std::max({1.0, std::abs(matrix[0]), std::abs(matrix[4])});
  const auto is = [&](std::size_t place, double value, double within) {
    return std::abs(matrix[place] - value) <= within;  // false of what is no number
  };
  if (!std::isfinite(matrix[1]) || !is(3, 0, kCalibrationRoundingPx) || !is(6, 0, divided) ||
      !is(7, 0, divided) || !is(8, 1, divided)) {
    throw std::invalid_argument("is not of the form fx 0 cx 0 fy cy 0 0 1: expected a camera without skew");
  }
  if (is(1, 0, kCalibrationRoundingPx)) return "";
  const double shift = largest_skew_shift_px(matrix, height_px);
  if (!(shift <= kMaxSkewShiftPx)) {
    throw std::invalid_argument(formatted(
        "has a skew of %.3g px, which moves pixels by up to %.2g px: expected a camera without skew (%.2g px "
        "at most). Calibrate again with the skew held at zero (cameracalibrator.py --fisheye-fix-skew)",
        matrix[1], shift, kMaxSkewShiftPx));
  }
  return shift <= kCalibrationRoundingPx
             ? ""
             : formatted(
                   "the skew of %.3g px is ignored: it moves no pixel by more than "
                   "%.2g px",
                   matrix[1], shift);
}

bool is_same_camera(const CameraParameters& a, const CameraParameters& b, double tolerance_px, int steps) {
  if (a == b) return true;
  if (a.width != b.width || a.height != b.height) return false;
  const CameraModel first(a), second(b);
  const double focal = std::max(first.focal(), second.focal());
  for (int row = 0; row <= steps; ++row) {
    for (int column = 0; column <= steps; ++column) {
      const Eigen::Vector2d pixel((a.width - 1.0) * column / steps, (a.height - 1.0) * row / steps);
      if (!(focal * (first.bearing(pixel) - second.bearing(pixel)).norm() <= tolerance_px)) return false;
    }
  }
  return true;
}

std::string difference(const CameraParameters& a, const CameraParameters& b) {
  if (a.width != b.width || a.height != b.height) {
    return formatted("%dx%d, then %dx%d", a.width, a.height, b.width, b.height);
  }
  if (a.fx != b.fx || a.fy != b.fy) {
    return formatted("fx %.9g, fy %.9g, then fx %.9g, fy %.9g", a.fx, a.fy, b.fx, b.fy);
  }
  if (a.cx != b.cx || a.cy != b.cy) {
    return formatted("cx %.9g, cy %.9g, then cx %.9g, cy %.9g", a.cx, a.cy, b.cx, b.cy);
  }
  return "different distortion";
}

namespace {

std::string likely_cause(int width, int height, int camera_width, int camera_height) {
  if (width == camera_height && height == camera_width) {
    return "; width and height are swapped: images are read as stored, and their orientation tag is ignored. "
           "Calibrate with images in the stored orientation";
  }
  if (width == 2 * camera_width && height == camera_height) {
    return "; the image is twice as wide: if it is a stereo pair side by side, crop the images of one camera";
  }
  if (width == camera_width && height == 2 * camera_height) {
    return "; the image is twice as high: if it is a stereo pair one above the other, crop the images of one "
           "camera";
  }
  const bool is_scaled = static_cast<long>(width) * camera_height == static_cast<long>(height) * camera_width;
  return is_scaled && camera_width > 0
             ? formatted(
                   "; the image is the same view at %.4g times the size: calibrate at this "
                   "size, or correct the stated size and binning",
                   static_cast<double>(width) / camera_width)
             : "";
}

}  // namespace

std::string size_mismatch_text(int image_width, int image_height, int camera_width, int camera_height,
                               const std::string& origin) {
  return formatted("is %dx%d, the calibration is for %dx%d", image_width, image_height, camera_width,
                   camera_height) +
         (origin.empty() ? "" : " (" + origin + ")") +
         likely_cause(image_width, image_height, camera_width, camera_height);
}

namespace {

/// The last part of the topic, by image_transport's rules: /camera/image_rect/compressed -> image_rect.
std::string base_name(std::string topic) {
  const auto last_part = [&] { return topic.substr(topic.rfind('/') + 1); };
  constexpr std::array transports{"compressed", "compressedDepth", "theora"};
  while (!topic.empty() && topic.back() == '/') topic.pop_back();
  const std::string last = last_part();
  const bool is_transport = std::any_of(transports.begin(), transports.end(),
                                        [&](const char* transport) { return last == transport; });
  if (is_transport && topic.find('/') != std::string::npos) topic.resize(topic.rfind('/'));
  return last_part();
}

bool begins_with(const std::string& text, const std::string& beginning) {
  return text.rfind(beginning, 0) == 0;
}

bool is_rectified_by_name(const std::string& topic) { return begins_with(base_name(topic), "image_rect"); }

/// What drivers and image_proc call images that are not rectified.
bool is_raw_by_name(const std::string& topic) {
  constexpr std::array names{"image_raw", "image_mono", "image_color"};
  const std::string name = base_name(topic);
  return std::any_of(names.begin(), names.end(), [&](const char* raw) { return begins_with(name, raw); });
}

}  // namespace

Rectification decide_rectification(const std::string& setting, const std::string& image_topic) {
  if (setting == "true") return {true, "rectified is set to true"};
  if (setting == "false") return {false, "rectified is set to false"};
  if (image_topic.empty()) return {false, "rectified is auto, and image files are assumed to be raw"};
  if (is_rectified_by_name(image_topic)) {
    return {true, "rectified is auto, and the name of " + image_topic + " begins with image_rect"};
  }
  return {false, "rectified is auto, and the name of " + image_topic + " does not begin with image_rect"};
}

std::string rectification_contradiction(const std::string& setting, const std::string& image_topic,
                                        bool has_distortion) {
  if (!has_distortion || image_topic.empty()) return "";
  if (setting == "true" && is_raw_by_name(image_topic)) {
    return "rectified is set to true, but " + image_topic +
           " is a topic name of raw images, and the calibration has distortion: the map is distorted if the "
           "images are raw. Set rectified to auto";
  }
  if (setting == "false" && is_rectified_by_name(image_topic)) {
    return "rectified is set to false, but " + image_topic +
           " is a topic name of rectified images, and the calibration has distortion: the map is distorted "
           "if they are undistorted twice. Set rectified to auto";
  }
  return "";
}

}  // namespace mono_pose_tracker
