#include "ros/frusta.h"

#include <algorithm>
#include <cmath>

#include "common/statistics.h"
#include "ros/messages.h"

namespace mono_pose_tracker {
namespace {

using visualization_msgs::Marker;

constexpr double kDepthShare = 0.1;  // of what is in view
constexpr double kTurned = M_PI / 12;
constexpr std::size_t kMostDrawn = 200;  // more frusta are a tangle on a screen
constexpr std::size_t kFewestPoints = 10;
constexpr double kLineShare = 0.02;  // thickness of the lines, of the depth

/// The corners of the image on the plane `depth` in front of the camera, clockwise from the upper left.
/// Distortion is left aside.
std::vector<Eigen::Vector3d> corners_of(const CameraParameters& camera, double depth) {
  std::vector<Eigen::Vector3d> corners;
  for (const auto& [u, v] :
       {std::pair{0, 0}, {camera.width, 0}, {camera.width, camera.height}, {0, camera.height}}) {
    corners.emplace_back(depth * (u - camera.cx) / camera.fx, depth * (v - camera.cy) / camera.fy, depth);
  }
  return corners;
}

bool is_in_view(const CameraParameters& camera, const Eigen::Vector3d& x_in_camera) {
  if (x_in_camera.z() <= 0) return false;
  const double u = camera.fx * x_in_camera.x() / x_in_camera.z() + camera.cx;
  const double v = camera.fy * x_in_camera.y() / x_in_camera.z() + camera.cy;
  return u >= 0 && v >= 0 && u <= camera.width && v <= camera.height;
}

bool is_same_view(const Rigid3& a, const Rigid3& b, double depth) {
  return (a.translation - b.translation).norm() < 0.5 * depth &&
         rotation_angle_between(a.rotation, b.rotation) < kTurned;
}

void add_segment(const Rigid3& map_from_camera, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                 Marker* marker) {
  marker->points.push_back(to_point(map_from_camera * a));
  marker->points.push_back(to_point(map_from_camera * b));
}

void add_frustum(const Rigid3& map_from_camera, const std::vector<Eigen::Vector3d>& corners, Marker* marker) {
  for (std::size_t i = 0; i < corners.size(); ++i) {
    add_segment(map_from_camera, Eigen::Vector3d::Zero(), corners[i], marker);
    add_segment(map_from_camera, corners[i], corners[(i + 1) % corners.size()], marker);
  }
}

Marker line_marker(const std_msgs::Header& header, const char* name, double line_width) {
  Marker marker;
  marker.header = header;
  marker.ns = name;
  marker.type = Marker::LINE_LIST;
  marker.pose.orientation.w = 1;
  marker.scale.x = line_width;
  marker.color.a = 1;
  return marker;
}

}  // namespace

double frustum_depth(const MapSnapshot& snapshot, const CameraParameters& camera) {
  if (snapshot.keyframes.empty()) return kDepthShare;
  const Rigid3 camera_from_map = snapshot.keyframes.back().map_from_camera.inverse();
  std::vector<double> in_view, distances;
  for (const ColoredPoint& point : snapshot.points) {
    const Eigen::Vector3d x_in_camera = camera_from_map * point.x_in_map.cast<double>();
    distances.push_back(x_in_camera.norm());
    if (is_in_view(camera, x_in_camera)) in_view.push_back(x_in_camera.z());
  }
  const double depth = median(std::move(in_view.size() >= kFewestPoints ? in_view : distances));
  return depth > 0 ? kDepthShare * depth : kDepthShare;
}

std::vector<KeyframePose> thinned_keyframes(const std::vector<KeyframePose>& keyframes, double depth) {
  std::vector<KeyframePose> drawn;
  for (auto k = keyframes.rbegin(); k != keyframes.rend() && drawn.size() < kMostDrawn; ++k) {
    const bool hidden = std::any_of(drawn.begin(), drawn.end(), [&](const KeyframePose& other) {
      return is_same_view(k->map_from_camera, other.map_from_camera, depth);
    });
    if (!hidden) drawn.push_back(*k);
  }
  return drawn;
}

visualization_msgs::MarkerArray to_keyframe_markers(const std_msgs::Header& header,
                                                    const CameraParameters& camera,
                                                    const std::vector<KeyframePose>& keyframes,
                                                    double depth) {
  Marker marker = line_marker(header, "keyframes", kLineShare * depth);
  marker.action = keyframes.empty() ? Marker::DELETE : Marker::ADD;
  marker.color.g = 0.6f;
  marker.color.b = 1.0f;
  const std::vector<Eigen::Vector3d> corners = corners_of(camera, depth);
  for (const KeyframePose& keyframe : keyframes) add_frustum(keyframe.map_from_camera, corners, &marker);
  visualization_msgs::MarkerArray array;
  array.markers.push_back(std::move(marker));
  return array;
}

Marker to_camera_marker(const std_msgs::Header& header, const CameraParameters& camera,
                        const Rigid3* map_from_camera, double depth) {
  // Larger than a keyframe: it must be found among them.
  Marker marker = line_marker(header, "camera", 4 * kLineShare * depth);
  marker.action = map_from_camera ? Marker::ADD : Marker::DELETE;
  marker.color.r = 1.0f;
  marker.color.g = marker.color.b = 0.25f;
  if (!map_from_camera) return marker;
  const std::vector<Eigen::Vector3d> corners = corners_of(camera, 1.5 * depth);
  add_frustum(*map_from_camera, corners, &marker);
  const Eigen::Vector3d top = 0.5 * (corners[0] + corners[1]);
  const Eigen::Vector3d tip = top - 0.25 * (corners[3] - corners[0]);
  add_segment(*map_from_camera, corners[0], tip, &marker);
  add_segment(*map_from_camera, tip, corners[1], &marker);
  return marker;
}

}  // namespace mono_pose_tracker
