#include "ros/output_frames.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

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
