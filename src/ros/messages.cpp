#include "ros/messages.h"

#include <sensor_msgs/point_cloud2_iterator.h>

#include <algorithm>

#include "common/time_stamp.h"

namespace mono_pose_tracker {
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

}  // namespace mono_pose_tracker
