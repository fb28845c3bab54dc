#include "ros/bag_writer.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <stdexcept>

#include "../support/temporary_folder.h"
#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {
namespace {

// The bag's own destructor throws then, which ended the process.
TEST(BagWriter, AFullDiskIsAnError) {
  EXPECT_THROW(
      {
        BagWriter bag("/dev/full", {});
        for (int i = 0; i < 3; ++i) bag.write(1000 + i, cv::Mat(480, 640, CV_8UC3, cv::Scalar(1, 2, 3)));
        bag.close();
      },
      std::runtime_error);
}

// The disk is full after a while: a file may not grow beyond a megabyte.
TEST(BagWriter, ADiskThatIsFullAfterAWhileIsAnError) {
  const TemporaryFolder folder;
  rlimit before;
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit megabyte = {1 << 20, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &megabyte), 0);
  EXPECT_THROW(
      {
        BagWriter bag(folder / "a.bag", {});
        for (int i = 0; i < 3; ++i) bag.write(1000 + i, cv::Mat(480, 640, CV_8UC3, cv::Scalar(1, 2, 3)));
        bag.close();
      },
      std::runtime_error);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
}

}  // namespace
}  // namespace mono_pose_tracker
