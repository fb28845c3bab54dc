#include "mono_pose_tracker/ros/debug_image.h"

#include <algorithm>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

namespace mono_pose_tracker {
namespace {

cv::Scalar color_of(State state) {
  switch (state) {
    case State::kTracking:
      return {80, 220, 80};
    case State::kLost:
      return {60, 60, 240};
    default:
      return {60, 200, 240};
  }
}

std::vector<std::string> describe(const FrameReport& report) {
  char counts[160];
  std::snprintf(counts, sizeof(counts), "features %d  matches %d  inliers %d  rms %.2f px", report.features,
                report.matches, report.inliers, report.reprojection_rms_px);
  char map[160];
  std::snprintf(map, sizeof(map), "map %u: keyframes %d  points %d", report.epoch, report.keyframes,
                report.landmarks);
  std::string head = to_string(report.state);
  if (report.reason != Reason::kOk) head += std::string(": ") + to_string(report.reason);
  std::vector<std::string> lines{head, counts, map};
  if (!report.reason_text.empty()) lines.insert(lines.begin() + 1, report.reason_text);
  return lines;
}

void draw_map(const Rigid3& map_from_camera, const CameraModel& camera, const MapSnapshot& map,
              cv::Mat& canvas) {
  const Rigid3 camera_from_map = map_from_camera.inverse();
  const int radius = std::max(1, canvas.cols / 400);
  for (const ColoredPoint& point : map.points) {
    Eigen::Vector2d pixel;
    if (!camera.project(camera_from_map * point.x_in_map.cast<double>(), &pixel) || !camera.in_image(pixel))
      continue;
    const cv::Point centre(cvRound(pixel.x()), cvRound(pixel.y()));
    cv::circle(canvas, centre, radius, {80, 220, 80}, cv::FILLED, cv::LINE_AA);
  }
}

void draw_text(const std::vector<std::string>& lines, const cv::Scalar& color, cv::Mat& canvas) {
  const double scale = std::max(0.35, canvas.cols / 900.0);  // readable in a small panel of rviz
  const int line_height = cvRound(28 * scale) + 4;           // px
  cv::Mat band = canvas.rowRange(0, std::min(canvas.rows, line_height * static_cast<int>(lines.size()) + 6));
  band *= 0.4;  // dark enough for the text to be read on any image
  for (std::size_t i = 0; i < lines.size(); ++i) {
    cv::putText(canvas, lines[i], {6, line_height * static_cast<int>(i + 1) - 4}, cv::FONT_HERSHEY_SIMPLEX,
                scale, i == 0 ? color : cv::Scalar(230, 230, 230), scale > 0.8 ? 2 : 1, cv::LINE_AA);
  }
}

}  // namespace

cv::Mat draw_debug_image(const cv::Mat& image, const FrameReport& report, const CameraModel& camera,
                         const MapSnapshot& map) {
  cv::Mat canvas;
  if (image.channels() == 1) {
    cv::cvtColor(image, canvas, cv::COLOR_GRAY2BGR);
  } else {
    canvas = image.clone();
  }
  if (report.map_from_camera) draw_map(*report.map_from_camera, camera, map, canvas);
  draw_text(describe(report), color_of(report.state), canvas);
  return canvas;
}

}  // namespace mono_pose_tracker
