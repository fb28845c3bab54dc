#include "io/given_positions.h"

#include <gtest/gtest.h>

#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

TEST(GivenPositions, TumLinesAreByStamp) {
  TemporaryFolder folder;
  const GivenPositions given =
      read_given_positions(folder.write("p.txt", "# stamps\n\n2 4 5 6 0 0 0 1\n1.5 1 2 3 0 0 0 1\n"));
  ASSERT_EQ(given.poses.size(), 2u);
  EXPECT_FALSE(given.origin);
  EXPECT_EQ(given.poses[0].stamp_ns, 1'500'000'000);
  EXPECT_EQ(given.poses[0].map_from_camera.translation, Eigen::Vector3d(1, 2, 3));
}

TEST(GivenPositions, GeodeticLinesAreEastNorthUpOfTheFirst) {
  TemporaryFolder folder;
  const GivenPositions given = read_given_positions(
      folder.write("p.txt", "# name lat lon alt\na.png 48 11 500\n my image.png \t48.001  11.001 510.5\r\n"));
  ASSERT_EQ(given.named.size(), 2u);
  ASSERT_TRUE(given.origin);
  EXPECT_EQ(given.origin->altitude, 500);
  EXPECT_EQ(given.named[0].name, "a.png");
  EXPECT_LT(given.named[0].x_in_world.norm(), 1e-8);
  EXPECT_EQ(given.named[1].name, "my image.png");
  // Of the ellipsoid's radii of curvature there: 74.6 m and 111.2 m, 10.5 m less what the Earth drops.
  EXPECT_NEAR(given.named[1].x_in_world.x(), 74.6, 0.1);
  EXPECT_NEAR(given.named[1].x_in_world.y(), 111.2, 0.1);
  EXPECT_NEAR(given.named[1].x_in_world.z(), 10.5, 0.01);
}

TEST(GivenPositions, EastNorthUpOnTheEquator) {
  // One degree of longitude on a circle of 6378137 m.
  const Eigen::Vector3d x = east_north_up({0, 0, 0}, {0, 1, 0});
  EXPECT_NEAR(x.x(), 6378137.0 * std::sin(3.14159265358979 / 180), 1e-3);
  EXPECT_NEAR(x.y(), 0, 1e-6);
  EXPECT_NEAR(x.z(), -6378137.0 * (1 - std::cos(3.14159265358979 / 180)), 1e-3);
}

TEST(GivenPositions, NamesWhatIsWrong) {
  TemporaryFolder folder;
  const auto expect_refused = [&](const std::string& content, const std::string& part) {
    const std::string path = folder.write("p.txt", content);
    try {
      read_given_positions(path);
      ADD_FAILURE() << content;
    } catch (const std::runtime_error& e) {
      const std::string said = e.what();
      EXPECT_NE(said.find(path), std::string::npos) << said;
      EXPECT_NE(said.find(part), std::string::npos) << said;
      EXPECT_NE(said.find("expected"), std::string::npos) << said;
    }
  };
  expect_refused("", "holds no position");
  expect_refused("# nothing\n", "holds no position");
  expect_refused("a.png 48 11\n", "line 1");
  expect_refused("a.png 48 11 5\nb.png 91 11 5\n", "line 2 has a latitude");
  expect_refused("a.png 48 11 5\nb.png 48 nan 5\n", "line 2 has 'nan'");
  expect_refused("a.png 48 11 5\na.png 48 12 5\n", "a.png a second time");
  expect_refused("1 2 3 4 5 6 7 8\n", "line 1");
  EXPECT_THROW(read_given_positions(folder / "missing"), std::runtime_error);
}

}  // namespace
}  // namespace mono_pose_tracker
