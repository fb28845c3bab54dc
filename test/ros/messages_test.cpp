#include "ros/messages.h"

#include <gtest/gtest.h>
#include <sensor_msgs/point_cloud2_iterator.h>

namespace mono_pose_tracker {
namespace {

// With ~tf_tolerance a stamp may lie behind the last that there is; roscpp's own sum throws there.
TEST(Messages, ALaterStampIsNoneBehindTheLastOne) {
  EXPECT_EQ(*later(ros::Time(10, 900000000), 200000000), ros::Time(11, 100000000));
  EXPECT_EQ(*later(ros::Time(10, 0), -1), ros::Time(9, 999999999));
  EXPECT_EQ(*later(ros::TIME_MAX - ros::Duration(0, 1), 1), ros::TIME_MAX);
  EXPECT_FALSE(later(ros::TIME_MAX, 1));
  EXPECT_FALSE(later(ros::TIME_MAX, static_cast<std::int64_t>(ros::TIME_MAX.toNSec())));
  EXPECT_FALSE(later(ros::Time(0, 0), -1));
}

TEST(Messages, TransformMapsTheChildIntoTheParent) {
  const Rigid3 map_from_camera(Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY())),
                               {1, 2, 3});
  std_msgs::Header header;
  header.frame_id = "map";
  const geometry_msgs::TransformStamped transform = to_transform(header, "camera", map_from_camera);
  EXPECT_EQ(transform.header.frame_id, "map");
  EXPECT_EQ(transform.child_frame_id, "camera");
  EXPECT_DOUBLE_EQ(transform.transform.translation.y, 2);
  EXPECT_DOUBLE_EQ(transform.transform.rotation.y, std::sin(0.25));
}

TEST(Messages, CovarianceIsRowMajor) {
  Matrix6d covariance = Matrix6d::Zero();
  covariance(0, 5) = 7;
  EXPECT_DOUBLE_EQ(to_pose_with_covariance({Rigid3(), covariance}).covariance[5], 7);
}

TEST(Messages, TwistIsInTheChildsFrame) {
  // Seen from the map the camera moves along x; it looks along x, so in its own frame it moves along z.
  const Eigen::Quaterniond looks_along_x(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY()));
  StampedEstimate before, after;
  before.parent_from_child.b_from_a = Rigid3(looks_along_x, Eigen::Vector3d(0, 0, 0));
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ()));
  after.parent_from_child.b_from_a = Rigid3(looks_along_x * turned, Eigen::Vector3d(1, 0, 0));
  after.stamp_ns = 500000000;
  const geometry_msgs::TwistWithCovariance twist = to_twist(before, after);
  EXPECT_NEAR(twist.twist.linear.z, 2, 1e-9);
  EXPECT_NEAR(twist.twist.linear.x, 0, 1e-9);
  EXPECT_NEAR(twist.twist.angular.z, 0.4, 1e-9);
}

TEST(Messages, CloudHoldsPositionsAndColours) {
  ColoredPoint point;
  point.x_in_map = {1, 2, 3};
  point.r = 10;
  point.g = 20;
  point.b = 30;
  const sensor_msgs::PointCloud2 none = to_point_cloud(std_msgs::Header(), {});
  EXPECT_EQ(none.width * none.height, 0u);
  EXPECT_EQ(none.fields.size(), 4u) << "x y z rgb, as with points";
  const sensor_msgs::PointCloud2 cloud = to_point_cloud(std_msgs::Header(), {point, point});
  ASSERT_EQ(cloud.width * cloud.height, 2u);
  sensor_msgs::PointCloud2ConstIterator<float> x(cloud, "x");
  sensor_msgs::PointCloud2ConstIterator<std::uint8_t> r(cloud, "r"), g(cloud, "g"), b(cloud, "b");
  EXPECT_EQ((x + 1)[2], 3.0f);
  EXPECT_EQ((r + 1)[0], 10);
  EXPECT_EQ((g + 1)[0], 20);
  EXPECT_EQ((b + 1)[0], 30);
}

TEST(Messages, StatusNamesItsCodes) {
  FrameReport report;
  report.state = State::kLost;
  report.reason = Reason::kTooFewMatches;
  report.stages = {{"features", 12.5}};
  const TrackerStatus status = to_status(report);
  EXPECT_EQ(status.state, TrackerStatus::LOST);
  EXPECT_EQ(status.state_name, "LOST");
  EXPECT_EQ(status.reason, TrackerStatus::TOO_FEW_MATCHES);
  EXPECT_EQ(status.reason_name, "TOO_FEW_MATCHES");
  EXPECT_EQ(status.stage_names.at(0), "features");
  EXPECT_FLOAT_EQ(status.stage_ms.at(0), 12.5f);
}

/// The numbers of the enumerations are those of the message.
TEST(Messages, CodesAgree) {
  EXPECT_EQ(static_cast<int>(State::kPaused), TrackerStatus::PAUSED);
  EXPECT_EQ(static_cast<int>(Reason::kDropped), TrackerStatus::DROPPED);
  EXPECT_EQ(static_cast<int>(Reason::kRelocalising), TrackerStatus::RELOCALISING);
  EXPECT_EQ(static_cast<int>(ScaleSource::kKnownBaseline), TrackerStatus::KNOWN_BASELINE);
  EXPECT_EQ(static_cast<int>(ScaleSource::kInitialMedianDepth), TrackerStatus::INITIAL_MEDIAN_DEPTH);
  EXPECT_EQ(static_cast<int>(ScaleSource::kMarker), TrackerStatus::MARKER);
  EXPECT_EQ(static_cast<int>(ScaleSource::kOdometry), TrackerStatus::ODOMETRY);
  EXPECT_EQ(static_cast<int>(CalibrationSource::kGuessed), TrackerStatus::GUESSED);
  EXPECT_EQ(static_cast<int>(CalibrationSource::kRefined), TrackerStatus::REFINED);
  EXPECT_EQ(static_cast<int>(Reason::kNotRigid), TrackerStatus::NOT_RIGID);
  EXPECT_EQ(static_cast<int>(Reason::kCalibrationChanged), TrackerStatus::CALIBRATION_CHANGED);
  EXPECT_EQ(static_cast<int>(Reason::kPaused), TrackerStatus::REASON_PAUSED);
  EXPECT_EQ(static_cast<int>(Reason::kInternalError), TrackerStatus::INTERNAL_ERROR);
}

}  // namespace
}  // namespace mono_pose_tracker
