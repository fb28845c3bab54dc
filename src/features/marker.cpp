#include "features/marker.h"

#include <algorithm>
#include <stdexcept>

#ifdef MONO_POSE_TRACKER_WITH_ARUCO
#include <opencv2/aruco.hpp>
#endif

namespace mono_pose_tracker {

namespace {

[[noreturn]] void refuse(const std::string& dictionary) {
  throw std::invalid_argument("marker dictionary " + dictionary + " is not known");
}

}  // namespace

#ifdef MONO_POSE_TRACKER_WITH_ARUCO

// In the order of cv::aruco::PREDEFINED_DICTIONARY_NAME.
const std::vector<std::string>& marker_dictionaries() {
  static const std::vector<std::string> names = {
      "4x4_50",  "4x4_100", "4x4_250",  "4x4_1000", "5x5_50",  "5x5_100", "5x5_250",  "5x5_1000", "6x6_50",
      "6x6_100", "6x6_250", "6x6_1000", "7x7_50",   "7x7_100", "7x7_250", "7x7_1000", "original"};
  return names;
}

std::vector<Eigen::Vector2d> find_marker(const cv::Mat& gray, const std::string& dictionary, int id) {
  const std::vector<std::string>& names = marker_dictionaries();
  const auto name = std::find(names.begin(), names.end(), dictionary);
  if (name == names.end()) refuse(dictionary);
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod =
      cv::aruco::CORNER_REFINE_SUBPIX;  // whole pixels would be the scale's error
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(gray, cv::aruco::getPredefinedDictionary(static_cast<int>(name - names.begin())),
                           corners, ids, parameters);
  const auto found = std::find(ids.begin(), ids.end(), id);
  // Two of the same: which of them another view sees can't be told.
  if (found == ids.end() || std::find(found + 1, ids.end(), id) != ids.end()) return {};
  std::vector<Eigen::Vector2d> result;
  for (const cv::Point2f& corner : corners[static_cast<std::size_t>(found - ids.begin())]) {
    result.emplace_back(corner.x, corner.y);
  }
  return result;
}

#else

const std::vector<std::string>& marker_dictionaries() {
  static const std::vector<std::string> none;
  return none;
}

std::vector<Eigen::Vector2d> find_marker(const cv::Mat&, const std::string& dictionary, int) {
  refuse(dictionary);
}

#endif

}  // namespace mono_pose_tracker
