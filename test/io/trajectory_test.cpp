#include "mono_pose_tracker/io/trajectory.h"

#include <gtest/gtest.h>

#include "common/statistics.h"
#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

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

}  // namespace
}  // namespace mono_pose_tracker
