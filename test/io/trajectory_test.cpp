#include <gtest/gtest.h>

#include <limits>

#include "common/statistics.h"
#include "common/time_stamp.h"
#include "io/given_positions.h"
#include "io/stamp.h"
#include "mono_pose_tracker/io/trajectory.h"
#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

std::int64_t parsed(const std::string& text) {
  std::int64_t stamp = -77;
  EXPECT_TRUE(parse_stamp(text, &stamp)) << text;
  return stamp;
}

TEST(Stamp, ParsesWithoutLosingANanosecond) {
  EXPECT_EQ(parsed("1403715273.262142976"), 1403715273262142976);
  EXPECT_EQ(parsed("1403715273.262143"), 1403715273262143000);
  EXPECT_EQ(parsed("0"), 0);
  EXPECT_EQ(parsed("7"), 7000000000);
  EXPECT_EQ(parsed("7."), 7000000000);
  EXPECT_EQ(parsed(".5"), 500000000);
  EXPECT_EQ(parsed("-1.000000001"), -1000000001);
  EXPECT_EQ(parsed("0.0000000004"), 0);
  EXPECT_EQ(parsed("0.0000000005"), 1);
  EXPECT_EQ(parsed("1.9999999999"), 2000000000);
  EXPECT_EQ(parsed("1.403715273262142976e+09"), 1403715273262142976);
  EXPECT_EQ(parsed("1.5E-3"), 1500000);
  EXPECT_EQ(parsed("4611686018.427387903"), kMaxStampNs);
}

TEST(Stamp, RefusesWhatIsNoNumber) {
  for (const char* text : {"", ".", "-", "abc", "1.2.3", "1,5", "1e", "1e+", "1e5x", "nan", "0x10", " 1",
                           "4611686018.427387904", "-4611686018.427387904", "1e30"}) {
    std::int64_t stamp = -77;
    EXPECT_FALSE(parse_stamp(text, &stamp)) << text;
    EXPECT_EQ(stamp, -77) << text;
  }
}

TEST(Stamp, FormatsNineDecimals) {
  EXPECT_EQ(format_stamp(0), "0.000000000");
  EXPECT_EQ(format_stamp(1), "0.000000001");
  EXPECT_EQ(format_stamp(-1), "-0.000000001");
  EXPECT_EQ(format_stamp(1403715273262142976), "1403715273.262142976");
  EXPECT_EQ(format_stamp(std::numeric_limits<std::int64_t>::min()), "-9223372036.854775808");
}

TEST(Stamp, ComesBackTheSame) {
  Random random(1);
  for (int i = 0; i < 10000; ++i) {
    const std::int64_t stamp = static_cast<std::int64_t>(random.next() >> (2 + random.index(60)));
    EXPECT_EQ(parsed(format_stamp(stamp)), stamp);
    EXPECT_EQ(parsed(format_stamp(-stamp)), -stamp);
  }
}

std::vector<StampedPose> random_poses(int count) {
  Random random(5);
  std::vector<StampedPose> poses(count);
  for (int i = 0; i < count; ++i) {
    poses[i].stamp_ns = 1403715273262142976 + i * 33333333;
    Eigen::Vector4d q;
    for (double& value : q) value = random.normal();
    poses[i].map_from_camera.rotation = Eigen::Quaterniond(q).normalized();
    for (double& value : poses[i].map_from_camera.translation) value = random.uniform(-10, 10);
  }
  return poses;
}

void expect_near(const StampedPose& a, const StampedPose& b) {
  EXPECT_EQ(a.stamp_ns, b.stamp_ns);
  EXPECT_LT((a.map_from_camera.translation - b.map_from_camera.translation).norm(), 1e-8);
  EXPECT_LT(rotation_angle_between(a.map_from_camera.rotation, b.map_from_camera.rotation), 1e-8);
}

TEST(Trajectory, IsReadAsWritten) {
  TemporaryFolder folder;
  const std::vector<StampedPose> poses = random_poses(20);
  write_tum(folder / "t.txt", {poses.rbegin(), poses.rend()});
  const std::vector<StampedPose> read = read_tum(folder / "t.txt");
  ASSERT_EQ(read.size(), poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) expect_near(read[i], poses[i]);
}

TEST(Trajectory, LinesAreTum) {
  TemporaryFolder folder;
  write_tum(folder / "t.txt", {{1500000001, Rigid3(Eigen::Quaterniond(-1, 0, 0, 0), {1, -2.5, 1.0 / 3})}});
  EXPECT_EQ(folder.read("t.txt"), "1.500000001 1 -2.5 0.333333333333 0 0 0 1\n");
}

TEST(Trajectory, ReadsTheLayoutsOfPublicDataSets) {
  TemporaryFolder folder;
  const std::vector<StampedPose> tum =
      read_tum(folder.write("tum.txt", "1403636579763555584 1 2 3 0.6 0 0 0.8\n"));
  EXPECT_EQ(tum.at(0).stamp_ns, 1403636579763555584);
  const std::vector<StampedPose> euroc = read_tum(folder.write(
      "data.csv",
      "#timestamp, p_RS_R_x [m], ...\n1403636579763555584,1,2,3,0.8,0.6,0,0,9,9,9,9,9,9,9,9,9\r\n"));
  expect_near(euroc.at(0), tum.at(0));
  const std::string poses = "1 0 0 1 0 1 0 2 0 0 1 3\n1 0 0 4 0 0 -1 5 0 1 0 6\n";
  const std::vector<StampedPose> kitti = read_tum(folder.write("07.txt", poses));
  ASSERT_EQ(kitti.size(), 2u);
  EXPECT_EQ(kitti[1].stamp_ns, 1000000000);
  EXPECT_EQ(kitti[1].map_from_camera.translation, Eigen::Vector3d(4, 5, 6));
  EXPECT_LT((kitti[1].map_from_camera.rotation * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitZ()).norm(),
            1e-12);
  folder.write("times.txt", "0.000000e+00\n1.037875e-01\n");
  EXPECT_EQ(read_tum(folder / "07.txt")[1].stamp_ns, 103787500);
  expect_error([&] { read_tum(folder.write("bad.txt", "1 2 3 4 5 6 7 8 9 10 11 12\n")); },
               {"bad.txt", "line 1", "not a rotation"});
}

// A map in metres made by a microscope has lengths that nine decimals would not hold.
TEST(Trajectory, SmallAndLargeLengthsKeepTheirDigits) {
  TemporaryFolder folder;
  for (const double unit : {1e-12, 1e-7, 1.0, 1e6}) {
    const Eigen::Vector3d t = unit * Eigen::Vector3d(1.23456789012, -2.34567890123, 3.45678901234);
    write_tum(folder / "t.txt", {{7, Rigid3(Eigen::Quaterniond::Identity(), t)}});
    const Eigen::Vector3d read = read_tum(folder / "t.txt").at(0).map_from_camera.translation;
    EXPECT_LT((read - t).norm(), 1e-11 * t.norm()) << unit;
  }
}

TEST(Trajectory, ReadsCommentsBlankLinesAndAnyOrder) {
  TemporaryFolder folder;
  const std::string path = folder.write("t.txt",
                                        "\xef\xbb\xbf# timestamp tx ...\r\n\n2 0 0 1 0 0 0 1\r\n"
                                        "  # more\n1\t0 0 2 0 0 0.70710678 0.70710678\n");
  const std::vector<StampedPose> poses = read_tum(path);
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_EQ(poses[0].stamp_ns, 1000000000);
  EXPECT_EQ(poses[0].map_from_camera.translation.z(), 2);
  EXPECT_NEAR(poses[0].map_from_camera.rotation.norm(), 1, 1e-15);
  EXPECT_EQ(poses[1].stamp_ns, 2000000000);
}

TEST(Trajectory, ErrorsNameFileAndLine) {
  TemporaryFolder folder;
  const auto expect = [&](const std::string& line, const std::string& problem) {
    const std::string path = folder.write("bad.txt", "# comment\n1 0 0 0 0 0 0 1\n" + line + "\n");
    expect_error([&] { read_tum(path); }, {path + ": line 3 ", problem, "expected"});
  };
  expect("2 0 0 0 0 0 0", "8 numbers");
  expect("2 0 0 0 0 0 0 1 9", "'9'");
  expect("2 0 0 nan 0 0 0 1", "8 numbers");
  expect("two 0 0 0 0 0 0 1", "'two'");
  expect("2,0,0,0,0,0,1", "8 numbers");
  expect("2 0 0 0 0 0 0 0", "quaternion");
  expect_error([&] { read_tum(folder / "none.txt"); }, {"none.txt", "expected"});
}

TEST(TrajectoryWriter, EachLineIsInTheFileAtOnce) {
  TemporaryFolder folder;
  const std::vector<StampedPose> poses = random_poses(3);
  TrajectoryWriter writer(folder / "live.txt");
  for (std::size_t i = 0; i < poses.size(); ++i) {
    writer.append(poses[i]);
    const std::vector<StampedPose> read = read_tum(folder / "live.txt");
    ASSERT_EQ(read.size(), i + 1);
    expect_near(read.back(), poses[i]);
  }
}

TEST(TrajectoryWriter, ALineTellsWhereAnotherMapBegins) {
  TemporaryFolder folder;
  const std::vector<StampedPose> poses = random_poses(4);
  const std::uint32_t epochs[] = {2, 2, 3, 3};
  TrajectoryWriter writer(folder / "live.txt");
  for (std::size_t i = 0; i < poses.size(); ++i) writer.append(poses[i], epochs[i]);
  const std::string text = folder.read("live.txt");
  EXPECT_NE(text.front(), '#') << "there is none before the first";
  EXPECT_NE(text.find("\n# a new map begins (map 3): another origin and scale\n"), std::string::npos) << text;
  const std::vector<std::vector<StampedPose>> maps = read_tum_maps(folder / "live.txt");
  ASSERT_EQ(maps.size(), 2u);
  EXPECT_EQ(maps[0].size(), 2u);
  ASSERT_EQ(maps[1].size(), 2u);
  expect_near(maps[1][0], poses[2]);
}

TEST(Trajectory, EpochsAreSortedEachByItself) {
  TemporaryFolder folder;
  const std::vector<StampedPose> poses = random_poses(5);
  // The stamps of the later epoch are the older ones: a recording that begins its time anew.
  write_tum_maps(folder / "t.txt", {{4, {poses[1], poses[0]}}, {1, {poses[4], poses[2], poses[3]}}, {2, {}}});
  const std::vector<std::vector<StampedPose>> maps = read_tum_maps(folder / "t.txt");
  ASSERT_EQ(maps.size(), 2u);
  ASSERT_EQ(maps[0].size(), 3u);
  ASSERT_EQ(maps[1].size(), 2u);
  for (int i = 0; i < 3; ++i) expect_near(maps[0][i], poses[2 + i]);
  for (int i = 0; i < 2; ++i) expect_near(maps[1][i], poses[i]);
  const std::string text = folder.read("t.txt");
  const std::string line = "# a new map begins (map 4)";
  EXPECT_EQ(text.find('#'), text.find(line)) << text;
  EXPECT_EQ(text.rfind('#'), text.find(line)) << "one between two: " << text;
  write_tum_maps(folder / "t.txt", {});
  EXPECT_EQ(folder.read("t.txt"), "");
}

TEST(Trajectory, SaysWhenItCannotWrite) {
  TemporaryFolder folder;
  expect_error([&] { write_tum(folder / "no/t.txt", {}); }, {"no/t.txt", "cannot be written"});
  expect_error([&] { write_tum_maps(folder / "no/t.txt", {}); }, {"no/t.txt", "cannot be written"});
  expect_error([&] { TrajectoryWriter writer(folder / "no/t.txt"); }, {"no/t.txt", "cannot be written"});
  expect_error([&] { TrajectoryWriter("/dev/full").append({}); }, {"/dev/full"});
}

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
