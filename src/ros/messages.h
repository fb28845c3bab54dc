#pragma once

#include <geometry_msgs/Point.h>
#include <geometry_msgs/Pose.h>
#include <geometry_msgs/PoseWithCovariance.h>
#include <geometry_msgs/TransformStamped.h>
#include <mono_pose_tracker/TrackerStatus.h>
#include <nav_msgs/Odometry.h>
#include <ros/time.h>
#include <sensor_msgs/PointCloud2.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/tracking/frame_report.h"
#include "ros/pose_estimate.h"

namespace mono_pose_tracker {

inline ros::Time to_ros_time(std::int64_t stamp_ns) {
  return ros::Time().fromNSec(static_cast<std::uint64_t>(stamp_ns));
}

/// The stamp plus so many ns. Nothing if ros::Time (seconds of 32 bits) cannot hold it; the sums of roscpp
/// throw there.
std::optional<ros::Time> later(const ros::Time& stamp, std::int64_t ns);

// None of these changes a frame or a unit: values are copied, and the message's header must name their frame.

geometry_msgs::Point to_point(const Eigen::Vector3d& x);
/// The pose of a in b: the header's frame is b.
geometry_msgs::Pose to_pose(const Rigid3& b_from_a);
/// The same; the covariance is row by row, of x y z and rotations about the fixed axes of b.
geometry_msgs::PoseWithCovariance to_pose_with_covariance(const PoseEstimate& b_from_a);
/// header.frame_id is the parent.
geometry_msgs::TransformStamped to_transform(const std_msgs::Header& header, const std::string& child_frame,
                                             const Rigid3& parent_from_child);

/// x y z rgb, as rviz reads it. The points are in header's frame already, whatever x_in_map says.
sensor_msgs::PointCloud2 to_point_cloud(const std_msgs::Header& header,
                                        const std::vector<ColoredPoint>& points);

struct StampedEstimate {
  std::int64_t stamp_ns = 0;
  PoseEstimate parent_from_child;
};

/// The velocity of the child between two times, along its own axes at the later one, with the covariance that
/// the poses give it. The stamps must differ.
geometry_msgs::TwistWithCovariance to_twist(const StampedEstimate& previous, const StampedEstimate& current);

/// All of a report but the header and the node's own counts.
TrackerStatus to_status(const FrameReport& report);

}  // namespace mono_pose_tracker
