#include "ros/trajectory_log.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>

#include "mono_pose_tracker/io/trajectory.h"
#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

FrameReport registered(std::int64_t second, std::uint32_t epoch = 1) {
  FrameReport report;
  report.stamp_ns = second * 1000000000;
  report.epoch = epoch;
  report.map_from_camera = Rigid3(Eigen::Quaterniond::Identity(), {0.1 + static_cast<double>(second), 2, 3});
  return report;
}

/// No file may grow beyond this, as on a disk that is full, while this object lives.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() { setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

/// The file's poses, which must be whole lines.
std::vector<StampedPose> poses_in(const TemporaryFolder& folder) {
  EXPECT_EQ(folder.read("t.txt").back(), '\n');
  return read_tum(folder / "t.txt");
}

TEST(TrajectoryLog, EachPoseIsInTheFileAtOnce) {
  TemporaryFolder folder;
  TrajectoryLog log(folder / "t.txt");
  log.append(FrameReport());  // not registered
  for (int i = 1; i <= 3; ++i) {
    log.append(registered(i));
    EXPECT_EQ(poses_in(folder).size(), static_cast<std::size_t>(i));
  }
  log.append(registered(4, 2));
  EXPECT_NE(folder.read("t.txt").find("# a new map begins (epoch 2)"), std::string::npos);
  EXPECT_EQ(log.problem(), "");
}

TEST(TrajectoryLog, WhatAFullDiskRefusesIsWrittenWhenThereIsSpace) {
  TemporaryFolder folder;
  TrajectoryLog log(folder / "t.txt");
  log.append(registered(1));
  const std::string before = folder.read("t.txt");
  for (const rlim_t room : {0, 5, 20}) {  // bytes: less than a line
    const FullDisk full(before.size() + room);
    log.append(registered(2));
    EXPECT_EQ(folder.read("t.txt"), before) << "half a line is none";
    EXPECT_NE(log.problem().find("t.txt: cannot be written (File too large)"), std::string::npos)
        << log.problem();
  }
  log.retry();
  EXPECT_EQ(log.problem(), "");
  EXPECT_EQ(poses_in(folder).size(), 4u);
  log.append(registered(3));
  EXPECT_EQ(poses_in(folder).back().stamp_ns, 3000000000);
}

TEST(TrajectoryLog, AFullDiskAtTheStartIsToldAsWell) {
  TrajectoryLog log("/dev/full");
  EXPECT_NE(log.problem().find("/dev/full: cannot be written (No space left on device)"), std::string::npos)
      << log.problem();
}

// What log rotation does, and whoever tidies up.
TEST(TrajectoryLog, AFileThatIsMovedAwayOrRemovedIsBegunAnew) {
  TemporaryFolder folder;
  TrajectoryLog log(folder / "t.txt");
  log.append(registered(1));
  std::filesystem::rename(folder / "t.txt", folder / "t.txt.1");
  log.append(registered(2));
  log.append(registered(3));
  EXPECT_EQ(read_tum(folder / "t.txt.1").size(), 1u);
  ASSERT_EQ(poses_in(folder).size(), 2u);
  EXPECT_EQ(folder.read("t.txt").rfind("# timestamp", 0), 0u) << "with its own head";
  std::filesystem::remove(folder / "t.txt");
  log.append(registered(4));
  ASSERT_EQ(poses_in(folder).size(), 1u);
  EXPECT_EQ(log.problem(), "");
}

TEST(TrajectoryLog, WhatIsFoundInItsPlaceIsKept) {
  TemporaryFolder folder;
  TrajectoryLog log(folder / "t.txt");
  log.append(registered(1));
  write_tum_trajectory(folder / "t.txt", std::vector<KeyframePose>(5, KeyframePose{5, Rigid3()}));
  log.append(registered(2));
  ASSERT_EQ(poses_in(folder).size(), 6u);
  EXPECT_EQ(poses_in(folder).back().stamp_ns, 2000000000);
}

TEST(TrajectoryLog, WhereItCannotBeBegunAnewPosesWait) {
  TemporaryFolder folder;
  const std::string path = folder / "t.txt";
  TrajectoryLog log(path);
  std::filesystem::remove(path);
  std::filesystem::create_directory(path);
  log.append(registered(1));
  EXPECT_NE(log.problem().find("t.txt: cannot be written (Is a directory)"), std::string::npos)
      << log.problem();
  std::filesystem::remove(path);
  log.retry();
  EXPECT_EQ(log.problem(), "");
  ASSERT_EQ(poses_in(folder).size(), 1u);
}

TEST(TrajectoryLog, PosesThatAreLostAreCounted) {
  TemporaryFolder folder;
  TrajectoryLog log(folder / "t.txt");
  {
    const FullDisk full(folder.read("t.txt").size());
    for (std::size_t i = 0; i < TrajectoryLog::kMostWaiting + 10; ++i) {
      log.append(registered(static_cast<std::int64_t>(i)));
    }
    EXPECT_NE(log.problem().find("are lost"), std::string::npos) << log.problem();
  }
  log.retry();
  EXPECT_EQ(log.problem(), "");
  const std::size_t written = poses_in(folder).size();
  const std::size_t lost = TrajectoryLog::kMostWaiting + 10 - written;
  EXPECT_NE(folder.read("t.txt").find("# " + std::to_string(lost) + " poses are missing here"),
            std::string::npos);
  EXPECT_EQ(poses_in(folder).back().stamp_ns / 1000000000,
            static_cast<std::int64_t>(TrajectoryLog::kMostWaiting + 9));
}

TEST(TrajectoryLog, AReaderThatSleepsHoldsNobodyUp) {
  TemporaryFolder folder;
  const std::string pipe = folder / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  expect_error([&] { TrajectoryLog log(pipe); }, {pipe, "cannot be written"});
  const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
  {
    TrajectoryLog log(pipe);
    for (int i = 0; i < 3000; ++i) log.append(registered(i));  // more than a pipe holds
    EXPECT_NE(log.problem(), "");
    std::string read(1 << 20, ' ');
    while (!log.problem().empty()) {
      ASSERT_GT(::read(reader, read.data(), read.size()), 0);
      log.retry();
    }
  }
  close(reader);
}

TEST(TrajectoryFile, IsWholeOrTheOneBefore) {
  TemporaryFolder folder;
  const std::vector<KeyframePose> poses(100, KeyframePose{5, Rigid3()});
  write_tum_trajectory(folder / "t.txt", poses);
  const std::string before = folder.read("t.txt");
  EXPECT_EQ(read_tum(folder / "t.txt").size(), 100u);
  {
    const FullDisk full(200);
    expect_error([&] { write_tum_trajectory(folder / "t.txt", poses); }, {"t.txt", "cannot be written"});
  }
  EXPECT_EQ(folder.read("t.txt"), before);
}

TEST(TrajectoryFile, IsNotReplacedByOneWithoutPoses) {
  TemporaryFolder folder;
  expect_error([&] { write_tum_trajectory(folder / "t.txt", {}); }, {"there is no pose yet"});
  EXPECT_FALSE(std::filesystem::exists(folder / "t.txt"));
  write_tum_trajectory(folder / "t.txt", {KeyframePose{5, Rigid3()}});
  const std::string before = folder.read("t.txt");
  expect_error([&] { write_tum_trajectory(folder / "t.txt", {}); }, {"there is no pose yet"});
  EXPECT_EQ(folder.read("t.txt"), before);
}

}  // namespace
}  // namespace mono_pose_tracker
