#include "mono_pose_tracker/ros/publishers.h"

#include <cv_bridge/cv_bridge.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Path.h>

#include <algorithm>
#include <utility>

#include "mono_pose_tracker/ros/messages.h"

namespace mono_pose_tracker {
namespace {

/// Depth of the drawn frusta in map units: a tenth of the median distance of the points from the newest
/// keyframe, so that they read well at any scale.
double frustum_depth(const MapSnapshot& snapshot) {
  if (snapshot.points.empty() || snapshot.keyframes.empty()) return 0.1;
  const Eigen::Vector3f centre = snapshot.keyframes.back().map_from_camera.translation.cast<float>();
  std::vector<float> distances;
  for (const ColoredPoint& point : snapshot.points) distances.push_back((point.x_in_map - centre).norm());
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return 0.1 * *middle;
}

/// From blue (old) to red (new), as rviz shows where the camera was.
ColoredPoint camera_position(const KeyframePose& pose, double age) {
  ColoredPoint point;
  point.x_in_map = pose.map_from_camera.translation.cast<float>();
  point.r = static_cast<std::uint8_t>(255 * (1 - age));
  point.g = 80;
  point.b = static_cast<std::uint8_t>(255 * age);
  return point;
}

}  // namespace

Publishers::Publishers(const NodeParameters& parameters, ros::NodeHandle private_handle)
    : parameters_(parameters) {
  constexpr bool kLatched = true;
  pose_ = private_handle.advertise<geometry_msgs::PoseWithCovarianceStamped>("pose", 10);
  odometry_ = private_handle.advertise<nav_msgs::Odometry>("odometry", 10);
  path_ = private_handle.advertise<nav_msgs::Path>("path", 1, kLatched);
  points_ = private_handle.advertise<sensor_msgs::PointCloud2>("points", 1, kLatched);
  camera_positions_ = private_handle.advertise<sensor_msgs::PointCloud2>("camera_positions", 1, kLatched);
  keyframes_ = private_handle.advertise<visualization_msgs::MarkerArray>("keyframes", 1, kLatched);
  debug_image_ = image_transport::ImageTransport(private_handle).advertise("debug_image", 1);
}

void Publishers::publish_frame(const std_msgs::Header& image_header, const FrameReport& report) {
  remember(report);
  if (!report.map_from_camera) return;
  std_msgs::Header header = image_header;
  header.frame_id = parameters_.map_frame;
  const std::string camera_frame = camera_frame_of(image_header);
  if (parameters_.publish_tf) {
    broadcaster_.sendTransform(to_transform(header, camera_frame, *report.map_from_camera));
  }
  geometry_msgs::PoseWithCovarianceStamped pose;
  pose.header = header;
  pose.pose = to_pose_with_covariance(*report.map_from_camera, report.covariance);
  pose_.publish(pose);
  nav_msgs::Odometry odometry;
  odometry.header = header;
  odometry.child_frame_id = camera_frame;
  odometry.pose = pose.pose;
  if (previous_ && previous_->epoch == report.epoch && previous_->stamp_ns < report.stamp_ns) {
    odometry.twist = to_twist(*previous_, report);
  } else {
    odometry.twist.covariance[0] = -1;  // no velocity is known yet
  }
  odometry_.publish(odometry);
  previous_ = report;
}

void Publishers::remember(const FrameReport& report) {
  const std::lock_guard<std::mutex> lock(mutex_);
  newest_stamp_ns_ = report.stamp_ns;
  if (report.epoch != epoch_) {  // poses of another map have another origin and scale
    epoch_ = report.epoch;
    poses_.clear();
    path_changed_ = true;
  }
  if (!report.map_from_camera) return;
  poses_.push_back({report.stamp_ns, *report.map_from_camera});
  if (poses_.size() > static_cast<std::size_t>(parameters_.path_max_length)) poses_.pop_front();
  path_changed_ = true;
}

/// tf takes neither an empty name nor the leading slash of older drivers.
std::string Publishers::camera_frame_of(const std_msgs::Header& image_header) const {
  if (!parameters_.camera_frame.empty()) return parameters_.camera_frame;
  const std::string& frame = image_header.frame_id;
  if (frame.empty() || frame == "/") return "camera";
  return frame.front() == '/' ? frame.substr(1) : frame;
}

std::vector<KeyframePose> Publishers::trajectory() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return {poses_.begin(), poses_.end()};
}

std_msgs::Header Publishers::map_header() const {
  std_msgs::Header header;
  header.frame_id = parameters_.map_frame;
  const std::lock_guard<std::mutex> lock(mutex_);
  header.stamp = to_ros_time(newest_stamp_ns_);
  return header;
}

void Publishers::publish_debug_image(const std_msgs::Header& header, const cv::Mat& bgr) const {
  debug_image_.publish(cv_bridge::CvImage(header, "bgr8", bgr).toImageMsg());
}

void Publishers::publish_map(const MapSnapshot& snapshot, const CameraParameters& camera) const {
  const std_msgs::Header header = map_header();
  points_.publish(to_point_cloud(header, snapshot.points));
  keyframes_.publish(to_frusta(header, camera, snapshot.keyframes, frustum_depth(snapshot)));
}

void Publishers::publish_path() {
  const std_msgs::Header header = map_header();
  std::vector<KeyframePose> poses;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!std::exchange(path_changed_, false)) return;
    poses.assign(poses_.begin(), poses_.end());
  }
  nav_msgs::Path path;
  path.header = header;
  path.poses.reserve(poses.size());
  std::vector<ColoredPoint> positions;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    geometry_msgs::PoseStamped pose;
    pose.header.frame_id = header.frame_id;
    pose.header.stamp = to_ros_time(poses[i].stamp_ns);
    pose.pose = to_pose(poses[i].map_from_camera);
    path.poses.push_back(std::move(pose));
    positions.push_back(
        camera_position(poses[i], 1 - static_cast<double>(i + 1) / static_cast<double>(poses.size())));
  }
  path_.publish(path);
  camera_positions_.publish(to_point_cloud(header, positions));
}

}  // namespace mono_pose_tracker
