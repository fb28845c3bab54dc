#pragma once

#include <geometry_msgs/Point.h>
#include <geometry_msgs/Pose.h>
#include <geometry_msgs/PoseWithCovariance.h>
#include <geometry_msgs/TransformStamped.h>
#include <mono_pose_tracker/TrackerStatus.h>
#include <nav_msgs/Odometry.h>
#include <ros/time.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>
#include <visualization_msgs/MarkerArray.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/tracking/frame_report.h"

namespace mono_pose_tracker {

/// b_from_a with its covariance as ROS defines it: x y z, then rotations about the fixed axes of b.
struct PoseEstimate {
  Rigid3 b_from_a;
  Matrix6d covariance = Matrix6d::Zero();
};

/// c_from_a, with c_from_b exact.
PoseEstimate operator*(const Rigid3& c_from_b, const PoseEstimate& b_from_a);
/// b_from_z, with a_from_z exact.
PoseEstimate operator*(const PoseEstimate& b_from_a, const Rigid3& a_from_z);
PoseEstimate inverse(const PoseEstimate& b_from_a);

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

/// Depth of the drawn frusta in map units: a tenth of the median depth of the landmarks visible in the newest
/// keyframe, so that they have a useful size at any scale. 0.1 if there are none.
double frustum_depth(const MapSnapshot& snapshot, const CameraParameters& camera);

/// Keyframes that are distinguishable when drawn `depth` deep: the newest, and each older one that differs
/// from all drawn ones by half a depth or 15 degrees. Their number is limited.
std::vector<KeyframePose> thinned_keyframes(const std::vector<KeyframePose>& keyframes, double depth);

/// One marker of line segments: the frustum of each keyframe, `depth` map units deep.
visualization_msgs::MarkerArray to_keyframe_markers(const std_msgs::Header& header,
                                                    const CameraParameters& camera,
                                                    const std::vector<KeyframePose>& keyframes, double depth);

/// The camera as it is now: a frustum with its upper side marked. Without a pose: the marker is taken away.
visualization_msgs::Marker to_camera_marker(const std_msgs::Header& header, const CameraParameters& camera,
                                            const Rigid3* map_from_camera, double depth);

}  // namespace mono_pose_tracker
