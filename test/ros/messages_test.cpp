#include <gtest/gtest.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <functional>

#include "common/statistics.h"
#include "ros/messages.h"

namespace mono_pose_tracker {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;

Rigid3 random_pose(Random& random) {
  Eigen::Vector4d q;
  Eigen::Vector3d t;
  for (int i = 0; i < 4; ++i) q[i] = random.normal();
  for (int i = 0; i < 3; ++i) t[i] = 2 * random.normal();
  return {Eigen::Quaterniond(q).normalized(), t};
}

PoseEstimate random_estimate(Random& random) {
  Matrix6d root;
  for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = random.normal();
  return {random_pose(random), root * root.transpose()};
}

/// x y z and rotations about the fixed axes, as ROS has it.
Rigid3 perturbed(const Rigid3& pose, const Vector6d& error) {
  const Eigen::Vector3d w = error.tail<3>();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(w.norm(), w.normalized()));
  return {turn * pose.rotation, pose.translation + error.head<3>()};
}

Vector6d error_between(const Rigid3& from, const Rigid3& to) {
  const Eigen::AngleAxisd turn((to.rotation * from.rotation.conjugate()).normalized());
  Vector6d error;
  error << to.translation - from.translation, turn.angle() * turn.axis();
  return error;
}

/// Holds the covariance against what the operation does to small errors.
void expect_propagated(const PoseEstimate& in, const std::function<PoseEstimate(const PoseEstimate&)>& f) {
  const double step = 1e-6;
  const PoseEstimate out = f(in);
  Matrix6d J;
  for (int i = 0; i < 6; ++i) {
    const Vector6d error = step * Vector6d::Unit(i);
    J.col(i) = error_between(out.b_from_a, f({perturbed(in.b_from_a, error), in.covariance}).b_from_a) / step;
  }
  const Matrix6d expected = J * in.covariance * J.transpose();
  EXPECT_LT((out.covariance - expected).norm(), 1e-4 * expected.norm());
}

TEST(PoseEstimate, CovarianceFollowsThePose) {
  Random random(4);
  for (int trial = 0; trial < 20; ++trial) {
    const PoseEstimate in = random_estimate(random);
    const Rigid3 other = random_pose(random);
    expect_propagated(in, [&](const PoseEstimate& p) { return other * p; });
    expect_propagated(in, [&](const PoseEstimate& p) { return p * other; });
    expect_propagated(in, [&](const PoseEstimate& p) { return inverse(p); });
  }
}

TEST(PoseEstimate, InverseTwiceIsTheSame) {
  Random random(5);
  const PoseEstimate in = random_estimate(random);
  const PoseEstimate out = inverse(inverse(in));
  EXPECT_LT((out.b_from_a.translation - in.b_from_a.translation).norm(), 1e-12);
  EXPECT_LT((out.covariance - in.covariance).norm(), 1e-9 * in.covariance.norm());
}

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

using visualization_msgs::Marker;

CameraParameters camera() {
  CameraParameters parameters;
  parameters.width = 640;
  parameters.height = 480;
  parameters.fx = parameters.fy = 500;
  parameters.cx = 319.5;
  parameters.cy = 239.5;
  parameters.distortion_model.clear();
  return parameters;
}

KeyframePose keyframe(double z, double turn = 0) {
  return {static_cast<std::int64_t>(1e9 * z),
          {Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY())), {0, 0, z}}};
}

void add_points(double z, int number, MapSnapshot* map) {
  for (int i = 0; i < number; ++i) {
    ColoredPoint point;
    point.x_in_map = Eigen::Vector3f(0.01f * static_cast<float>(i), 0, static_cast<float>(z));
    map->points.push_back(point);
  }
}

TEST(Frusta, AreAsDeepAsATenthOfWhatIsInView) {
  MapSnapshot map;
  map.keyframes = {keyframe(0)};
  add_points(3, 20, &map);
  EXPECT_NEAR(frustum_depth(map, camera()), 0.3, 1e-6);
}

TEST(Frusta, DoNotGrowAsTheMapIsLeftBehind) {
  // A car: most points lie behind, the newest keyframe sees a street as deep as the first did.
  MapSnapshot map;
  for (int i = 0; i <= 100; ++i) {
    map.keyframes.push_back(keyframe(i));
    add_points(i + 3, 20, &map);
  }
  EXPECT_NEAR(frustum_depth(map, camera()), 0.2, 0.01);  // 1, 2 and 3 ahead
}

TEST(Frusta, HaveADepthWithoutPointsOrKeyframes) {
  MapSnapshot map;
  EXPECT_GT(frustum_depth(map, camera()), 0);
  map.keyframes = {keyframe(0)};
  EXPECT_GT(frustum_depth(map, camera()), 0);
}

TEST(Frusta, KeyframesAreThinned) {
  std::vector<KeyframePose> keyframes;
  for (int i = 0; i < 100; ++i) keyframes.push_back(keyframe(0.01 * i));
  const std::vector<KeyframePose> drawn = thinned_keyframes(keyframes, 0.1998);
  ASSERT_EQ(drawn.size(), 10u);
  EXPECT_EQ(drawn.front().stamp_ns, keyframes.back().stamp_ns) << "the newest is always there";
  for (std::size_t i = 1; i < drawn.size(); ++i) {
    const double step =
        (drawn[i].map_from_camera.translation - drawn[i - 1].map_from_camera.translation).norm();
    EXPECT_NEAR(step, 0.1, 1e-9);
  }
}

TEST(Frusta, ATurnOnTheSpotIsShown) {
  EXPECT_EQ(thinned_keyframes({keyframe(0, 0), keyframe(0, 0.1), keyframe(0, 1)}, 0.1).size(), 2u);
}

TEST(Frusta, LongPathsStayLegible) {
  std::vector<KeyframePose> keyframes;
  for (int i = 0; i < 5000; ++i) keyframes.push_back(keyframe(i));
  EXPECT_LE(thinned_keyframes(keyframes, 0.1).size(), 200u);
}

TEST(Frusta, TheCameraIsDrawnWhereItIs) {
  std_msgs::Header header;
  header.frame_id = "map";
  const Rigid3 pose = keyframe(7).map_from_camera;
  const Marker marker = to_camera_marker(header, camera(), &pose, 0.25);
  EXPECT_EQ(marker.action, Marker::ADD);
  EXPECT_EQ(marker.header.frame_id, "map");
  ASSERT_FALSE(marker.points.empty());
  double low = 1e9, high = -1e9;
  for (const geometry_msgs::Point& point : marker.points) {
    low = std::min(low, point.z);
    high = std::max(high, point.z);
  }
  EXPECT_NEAR(low, 7, 1e-9) << "its tip is the camera's centre";
  EXPECT_NEAR(high, 7.375, 1e-9) << "it looks forward";
}

TEST(Frusta, ALostCameraIsTakenAway) {
  const Marker marker = to_camera_marker({}, camera(), nullptr, 0.25);
  EXPECT_EQ(marker.action, Marker::DELETE);
}

}  // namespace

}  // namespace mono_pose_tracker
