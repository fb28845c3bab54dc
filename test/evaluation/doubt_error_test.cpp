#include "evaluation/doubt_error.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/statistics.h"
#include "mono_pose_tracker/geometry/sim3.h"
#include "support/helix_walk.h"

namespace mono_pose_tracker {
namespace {

std::vector<StampedPose> walk(int count) { return helix_walk(count, 1); }

// The same cameras in another map, off by a centimetre and a twentieth of a degree or so.
std::vector<ReportedPose> reported(const std::vector<StampedPose>& poses, const Sim3& map_from_reference,
                                   std::uint32_t map_id) {
  Random random(7);
  std::vector<ReportedPose> result;
  for (const StampedPose& pose : poses) {
    const Eigen::Vector3d noise(random.normal(), random.normal(), random.normal());
    const Rigid3& truth = pose.map_from_camera;
    const Eigen::Quaterniond rotation = map_from_reference.rotation * truth.rotation * turn(0.05, noise);
    result.push_back(
        {pose.stamp_ns, map_id,
         Rigid3(rotation, map_from_reference * Eigen::Vector3d(truth.translation + 0.01 * noise)), false});
  }
  return result;
}

std::vector<std::int64_t> stamps_off(const std::vector<PoseDeviation>& deviations) {
  std::vector<std::int64_t> stamps;
  for (const PoseDeviation& d : deviations) {
    if (d.off) stamps.push_back(d.stamp_ns);
  }
  return stamps;
}

const Sim3 kMap(0.3, turn(40, {1, 2, 3}), {5, -2, 1}), kOther(7, turn(100, {-1, 0, 1}), {0, 9, 0});

TEST(DoubtError, ThoseThatAreOffAreFoundWhateverTheMapsFrame) {
  const std::vector<StampedPose> reference = walk(60);
  std::vector<ReportedPose> poses = reported(reference, kMap, 1);
  for (int i = 30; i < 45; ++i) {  // a quarter, all to one side: a fit to all would follow them
    poses[i].map_from_camera.translation += 0.3 * Eigen::Vector3d(1, 0, 0);
    poses[i].doubtful = i < 40;
  }
  poses[50].map_from_camera.rotation = poses[50].map_from_camera.rotation * turn(1, {0, 1, 0});
  const std::vector<PoseDeviation> deviations = deviations_of(reference, poses);
  ASSERT_EQ(deviations.size(), 60u);
  std::vector<std::int64_t> expected;
  for (int i = 30; i < 45; ++i) expected.push_back(i);
  expected.push_back(50);
  EXPECT_EQ(stamps_off(deviations), expected);
  EXPECT_NEAR(deviations[35].position, 1, 0.1) << "in the reference's unit";
  EXPECT_NEAR(deviations[50].rotation_deg, 1, 0.2);
  EXPECT_TRUE(deviations[39].doubtful);
  EXPECT_FALSE(deviations[40].doubtful);
}

TEST(DoubtError, EachMapIsLaidOverTheReferenceByItself) {
  const std::vector<StampedPose> reference = walk(60);
  std::vector<ReportedPose> poses = reported(reference, kMap, 1);
  const std::vector<ReportedPose> later = reported(reference, kOther, 4);
  std::copy(later.begin() + 35, later.end(), poses.begin() + 35);
  const std::vector<PoseDeviation> deviations = deviations_of(reference, poses);
  EXPECT_EQ(deviations.size(), 60u);
  EXPECT_TRUE(stamps_off(deviations).empty());
}

TEST(DoubtError, PosesWithoutAReferenceAreExcluded) {
  std::vector<StampedPose> reference = walk(60);
  std::vector<ReportedPose> poses = reported(reference, kMap, 1);
  for (int i = 0; i < 9; ++i) poses[i].map_id = 2;  // too few to be aligned
  reference.erase(reference.begin() + 20);
  const std::vector<PoseDeviation> deviations = deviations_of(reference, poses);
  EXPECT_EQ(deviations.size(), 50u);
  EXPECT_EQ(deviations.front().stamp_ns, 9);
  EXPECT_TRUE(deviations_of({}, poses).empty());
  EXPECT_TRUE(deviations_of(reference, {}).empty());
}

}  // namespace
}  // namespace mono_pose_tracker
