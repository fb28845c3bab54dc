#include <gtest/gtest.h>

#include <random>

#include "ros/output_frames.h"

namespace mono_pose_tracker {
namespace {

// A head of half-width 0.12 that is seen from the front at first, as far from the camera as a map begins.
const Eigen::Vector3d kCentre(0.1, -0.05, 1.0);
const Eigen::Vector3d kHalfAxes(0.12, 0.16, 0.14);
constexpr double kExtent = 2 * 0.16;

/// Points on its skin, in the order in which it turns them to the camera: those in front first, then round
/// the vertical axis. `front_share` of them lie on the half in front, which has the face.
std::vector<ColoredPoint> skin(int count, double front_share) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::vector<std::pair<double, ColoredPoint>> by_angle;
  for (int i = 0; i < count; ++i) {
    Eigen::Vector3d direction(normal(random), normal(random), normal(random));
    direction.normalize();
    direction.z() = std::abs(direction.z()) * (i < front_share * count ? -1 : 1);
    ColoredPoint point;
    point.x_in_map = (kCentre + kHalfAxes.cwiseProduct(direction)).cast<float>();
    by_angle.emplace_back(std::abs(std::atan2(direction.x(), -direction.z())), point);
  }
  std::sort(by_angle.begin(), by_angle.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<ColoredPoint> points;
  for (const auto& entry : by_angle) points.push_back(entry.second);
  return points;
}

std::vector<ColoredPoint> first_of(const std::vector<ColoredPoint>& points, std::size_t count) {
  return {points.begin(), points.begin() + static_cast<std::ptrdiff_t>(count)};
}

/// The object is seen as it turns, in so many revisions of its map.
ObjectCentre turned(const std::vector<ColoredPoint>& points, int revisions) {
  ObjectCentre centre;
  for (int i = 1; i <= revisions; ++i) {
    centre.see(1, first_of(points, points.size() * static_cast<std::size_t>(i) / revisions));
    centre.follow(1);
  }
  return centre;
}

TEST(ObjectCentre, IsInTheMiddleOfTheObjectInTheEnd) {
  // Where the face has four of five points their median is off by 16 % of the extent.
  for (const auto& [front_share, most] : {std::pair(0.5, 0.05), std::pair(0.8, 0.08)}) {
    const ObjectCentre centre = turned(skin(3000, front_share), 60);
    EXPECT_LT((centre.in_map() - kCentre).norm(), most * kExtent) << front_share;
    EXPECT_NEAR(centre.extent(), kExtent, 0.15 * kExtent);
    EXPECT_GT(centre.moves(1), 0u);
    EXPECT_LT(centre.moves(1), 20u) << "not with every revision";
  }
}

TEST(ObjectCentre, BeginsWithTheFirstPointsAndMovesWhenTheyAreOffByMoreThanItsShare) {
  std::vector<ColoredPoint> points = skin(2000, 0.5);
  ObjectCentre centre;
  EXPECT_TRUE(centre.wants_points(3));
  centre.see(3, points);
  EXPECT_FALSE(centre.wants_points(3));
  EXPECT_FALSE(centre.follow(3)) << "a beginning is no move";
  const Eigen::Vector3d first = centre.in_map();

  const auto shifted = [&](double share) {
    std::vector<ColoredPoint> moved = points;
    for (ColoredPoint& point : moved) point.x_in_map.x() += static_cast<float>(share * centre.extent());
    return moved;
  };
  centre.see(3, shifted(0.04));
  EXPECT_FALSE(centre.follow(3));
  EXPECT_EQ(centre.in_map(), first);
  centre.see(3, shifted(0.06));
  EXPECT_EQ(centre.in_map(), first) << "seeing moves nothing";
  const auto moved = centre.follow(3);
  ASSERT_TRUE(moved);
  EXPECT_NEAR(moved->x(), 0.06 * centre.extent(), 1e-6);
  EXPECT_EQ(centre.in_map(), first + *moved);
  EXPECT_EQ(centre.moves(3), 1u);
  EXPECT_EQ(centre.moves(2), 0u);
  EXPECT_FALSE(centre.follow(3)) << "once";
}

TEST(ObjectCentre, BeginsAnewWithAnotherMap) {
  ObjectCentre centre = turned(skin(1000, 0.5), 10);
  ASSERT_GT(centre.moves(1), 0u);
  const Eigen::Vector3d first = centre.in_map();
  std::vector<ColoredPoint> points = skin(1000, 0.5);
  for (ColoredPoint& point : points) point.x_in_map.y() += 5;
  EXPECT_TRUE(centre.wants_points(2));
  centre.see(2, points);
  EXPECT_FALSE(centre.follow(1)) << "frames of the map before go on as they were";
  EXPECT_EQ(centre.in_map(), first);
  EXPECT_FALSE(centre.follow(2));
  EXPECT_NEAR(centre.in_map().y(), kCentre.y() + 5, 0.05 * kExtent);
  EXPECT_EQ(centre.moves(2), 0u);
}

TEST(ObjectCentre, AFewPointsMayBeAnywhere) {
  std::vector<ColoredPoint> points = skin(2000, 0.5);
  for (int i = 0; i < 80; ++i) points[25 * i].x_in_map = Eigen::Vector3f(0.5f * i, 0, 30);
  const std::optional<ObjectBox> box = box_of(points);
  ASSERT_TRUE(box);
  EXPECT_LT((box->centre - kCentre).norm(), 0.1 * kExtent);
  EXPECT_LT(box->extent, 1.1 * kExtent);
}

TEST(ObjectCentre, NoPointsAreNoObject) {
  EXPECT_FALSE(box_of({}));
  ObjectCentre centre;
  centre.see(1, {});
  EXPECT_TRUE(centre.wants_points(1));
  EXPECT_FALSE(centre.follow(1));
  centre.see(1, std::vector<ColoredPoint>(1));
  EXPECT_FALSE(centre.follow(1));
  EXPECT_EQ(centre.extent(), 0);
}

// tf2 knows no leading slashes; there are drivers that send one, and name spaces that are joined to two.
TEST(OutputFrames, LeadingSlashesOfAnImagesFrameAreTakenOff) {
  FrameOptions options;
  options.publish_tf = false;  // without tf nothing here needs a master
  const OutputFrames frames(options, [](const std::string&, const std::string&) {});
  FrameReport report;
  report.map_from_camera = Rigid3();
  const auto child_of = [&](const std::string& frame_id) {
    std_msgs::Header header;
    header.frame_id = frame_id;
    return frames.published_pose(header, report)->child_frame;
  };
  EXPECT_EQ(child_of("cam"), "cam");
  EXPECT_EQ(child_of("/cam"), "cam");
  EXPECT_EQ(child_of("//cam//x/"), "cam//x/");
  EXPECT_EQ(child_of("//"), "camera");
  EXPECT_EQ(child_of(""), "camera");
}

}  // namespace

}  // namespace mono_pose_tracker
