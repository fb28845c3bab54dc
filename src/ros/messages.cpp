#include "ros/messages.h"

#include <sensor_msgs/point_cloud2_iterator.h>

#include <algorithm>
#include <cmath>

#include "common/statistics.h"
#include "common/time_stamp.h"

namespace mono_pose_tracker {

// All to first order in an error (dt, w): t becomes t + dt, R becomes exp(w) R.

PoseEstimate operator*(const Rigid3& c_from_b, const PoseEstimate& b_from_a) {
  const Eigen::Matrix3d R = c_from_b.rotation_matrix();
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = J.bottomRightCorner<3, 3>() = R;
  return {c_from_b * b_from_a.b_from_a, J * b_from_a.covariance * J.transpose()};
}

PoseEstimate operator*(const PoseEstimate& b_from_a, const Rigid3& a_from_z) {
  Matrix6d J = Matrix6d::Identity();  // t' = R t_z + t moves by dt + w x (R t_z)
  J.topRightCorner<3, 3>() = -cross_matrix(b_from_a.b_from_a.rotation * a_from_z.translation);
  return {b_from_a.b_from_a * a_from_z, J * b_from_a.covariance * J.transpose()};
}

PoseEstimate inverse(const PoseEstimate& b_from_a) {
  const Eigen::Matrix3d Rt = b_from_a.b_from_a.rotation_matrix().transpose();
  Matrix6d J = Matrix6d::Zero();  // -R^T t moves by -R^T dt - R^T [t]x w, R^T turns by -R^T w
  J.topLeftCorner<3, 3>() = J.bottomRightCorner<3, 3>() = -Rt;
  J.topRightCorner<3, 3>() = -Rt * cross_matrix(b_from_a.b_from_a.translation);
  return {b_from_a.b_from_a.inverse(), J * b_from_a.covariance * J.transpose()};
}

namespace {

geometry_msgs::Vector3 to_vector(const Eigen::Vector3d& x) {
  geometry_msgs::Vector3 vector;
  vector.x = x.x();
  vector.y = x.y();
  vector.z = x.z();
  return vector;
}

geometry_msgs::Quaternion to_quaternion(const Eigen::Quaterniond& q) {
  geometry_msgs::Quaternion quaternion;
  quaternion.x = q.x();
  quaternion.y = q.y();
  quaternion.z = q.z();
  quaternion.w = q.w();
  return quaternion;
}

void copy_row_major(const Matrix6d& matrix, boost::array<double, 36>& out) {
  Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(out.data()) = matrix;
}

}  // namespace

std::optional<ros::Time> later(const ros::Time& stamp, std::int64_t ns) {
  const std::int64_t sum = static_cast<std::int64_t>(stamp.toNSec()) + ns;
  if (sum < 0 || sum > static_cast<std::int64_t>(ros::TIME_MAX.toNSec())) return std::nullopt;
  return to_ros_time(sum);
}

geometry_msgs::Point to_point(const Eigen::Vector3d& x) {
  geometry_msgs::Point point;
  point.x = x.x();
  point.y = x.y();
  point.z = x.z();
  return point;
}

geometry_msgs::Pose to_pose(const Rigid3& b_from_a) {
  geometry_msgs::Pose pose;
  pose.position = to_point(b_from_a.translation);
  pose.orientation = to_quaternion(b_from_a.rotation);
  return pose;
}

geometry_msgs::PoseWithCovariance to_pose_with_covariance(const PoseEstimate& b_from_a) {
  geometry_msgs::PoseWithCovariance pose;
  pose.pose = to_pose(b_from_a.b_from_a);
  copy_row_major(b_from_a.covariance, pose.covariance);
  return pose;
}

geometry_msgs::TransformStamped to_transform(const std_msgs::Header& header, const std::string& child_frame,
                                             const Rigid3& parent_from_child) {
  geometry_msgs::TransformStamped transform;
  transform.header = header;
  transform.child_frame_id = child_frame;
  transform.transform.translation = to_vector(parent_from_child.translation);
  transform.transform.rotation = to_quaternion(parent_from_child.rotation);
  return transform;
}

sensor_msgs::PointCloud2 to_point_cloud(const std_msgs::Header& header,
                                        const std::vector<ColoredPoint>& points) {
  sensor_msgs::PointCloud2 cloud;
  cloud.header = header;
  cloud.is_dense = true;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2FieldsByString(2, "xyz", "rgb");
  modifier.resize(points.size());
  if (points.empty()) return cloud;  // an iterator takes the address of the first byte
  sensor_msgs::PointCloud2Iterator<float> x(cloud, "x");
  sensor_msgs::PointCloud2Iterator<std::uint8_t> b(cloud, "rgb");  // little endian: b g r
  for (const ColoredPoint& point : points) {
    std::copy_n(point.x_in_map.data(), 3, &x[0]);
    b[0] = point.b;
    b[1] = point.g;
    b[2] = point.r;
    ++x;
    ++b;
  }
  return cloud;
}

geometry_msgs::TwistWithCovariance to_twist(const StampedEstimate& previous, const StampedEstimate& current) {
  geometry_msgs::TwistWithCovariance twist;
  const double seconds = seconds_between(previous.stamp_ns, current.stamp_ns);
  const Rigid3& parent_from_previous = previous.parent_from_child.b_from_a;
  const Rigid3& parent_from_current = current.parent_from_child.b_from_a;
  const Rigid3 previous_from_current = parent_from_previous.inverse() * parent_from_current;
  const Eigen::Matrix3d child_from_parent = parent_from_current.rotation.conjugate().toRotationMatrix();
  const Eigen::AngleAxisd turn(previous_from_current.rotation);
  const Eigen::Vector3d step = parent_from_current.translation - parent_from_previous.translation;
  twist.twist.linear = to_vector(child_from_parent * step / seconds);
  twist.twist.angular = to_vector(turn.angle() * turn.axis() / seconds);
  Matrix6d rotate = Matrix6d::Zero();
  rotate.topLeftCorner<3, 3>() = rotate.bottomRightCorner<3, 3>() = child_from_parent;
  const Matrix6d sum = previous.parent_from_child.covariance + current.parent_from_child.covariance;
  copy_row_major(rotate * sum * rotate.transpose() / (seconds * seconds), twist.covariance);
  return twist;
}

TrackerStatus to_status(const FrameReport& report) {
  TrackerStatus status;
  status.state = static_cast<std::uint8_t>(report.state);
  status.state_name = to_string(report.state);
  status.reason = static_cast<std::uint8_t>(report.reason);
  status.reason_name = to_string(report.reason);
  status.reason_text = report.reason_text;
  status.epoch = report.epoch;
  status.map_id = report.map_id;
  status.corrections = report.corrections;
  status.scale = static_cast<std::uint8_t>(report.scale);
  status.scale_name = to_string(report.scale);
  status.calibration = static_cast<std::uint8_t>(report.calibration);
  status.calibration_name = to_string(report.calibration);
  status.features = static_cast<std::uint32_t>(report.features);
  status.matches = static_cast<std::uint32_t>(report.matches);
  status.inliers = static_cast<std::uint32_t>(report.inliers);
  status.median_parallax_deg = static_cast<float>(report.median_parallax_deg);
  status.reprojection_rms_px = static_cast<float>(report.reprojection_rms_px);
  status.keyframes = static_cast<std::uint32_t>(report.keyframes);
  status.landmarks = static_cast<std::uint32_t>(report.landmarks);
  status.worker_backlog = static_cast<std::uint32_t>(report.worker_backlog);
  status.load_level = static_cast<std::uint8_t>(report.load_level);
  for (const auto& [name, milliseconds] : report.stages) {
    status.stage_names.push_back(name);
    status.stage_ms.push_back(static_cast<float>(milliseconds));
  }
  return status;
}

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
