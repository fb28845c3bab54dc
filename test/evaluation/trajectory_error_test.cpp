#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "common/statistics.h"
#include "evaluation/doubt_error.h"
#include "evaluation/trajectory_plot.h"
#include "mono_pose_tracker/evaluation/trajectory_error.h"
#include "mono_pose_tracker/geometry/sim3.h"
#include "mono_pose_tracker/io/trajectory.h"
#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

inline Eigen::Quaterniond turn(double degrees, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(degrees * M_PI / 180, axis.normalized()));
}

/// A camera that walks along a helix and looks about.
inline std::vector<StampedPose> helix_walk(int count, std::int64_t period_ns) {
  std::vector<StampedPose> poses(count);
  for (int i = 0; i < count; ++i) {
    const double t = 0.1 * i;
    poses[i] = {period_ns * i,
                Rigid3(turn(20 * t, {1, t, 0.3}), {3 * std::cos(t), 3 * std::sin(t), 0.5 * t})};
  }
  return poses;
}

constexpr std::int64_t kMillisecond = 1000000;
constexpr std::int64_t kTolerance = 10 * kMillisecond;

std::vector<StampedPose> slow_walk(int count) { return helix_walk(count, 100 * kMillisecond); }

/// The same cameras in another map.
std::vector<StampedPose> seen_from(const Sim3& other_from_map, std::vector<StampedPose> poses) {
  for (StampedPose& pose : poses) {
    pose.map_from_camera = Rigid3(other_from_map.rotation * pose.map_from_camera.rotation,
                                  other_from_map * pose.map_from_camera.translation);
  }
  return poses;
}

Sim3 some_map() {
  Sim3 sim;
  sim.scale = 0.25;
  sim.rotation = turn(130, {1, 2, -3});
  sim.translation = {5, -6, 7};
  return sim;
}

TEST(TrajectoryError, AnotherMapIsNoError) {
  const std::vector<StampedPose> reference = slow_walk(50);
  const TrajectoryError error = evaluate_trajectory(reference, seen_from(some_map(), reference), kTolerance);
  EXPECT_EQ(error.frames_reference, 50);
  EXPECT_EQ(error.frames_matched, 50);
  EXPECT_NEAR(error.reference_from_estimate.scale, 4, 1e-12);
  EXPECT_LT(error.position_max, 1e-12);
  EXPECT_LT(error.rotation_max_deg, 1e-5);
  EXPECT_LT(error.relative_rotation_median_deg, 1e-5);
  EXPECT_LT(error.relative_direction_median_deg, 1e-5);
  // A helix: 49 chords of radius 3, 0.1 rad and 0.05 rise.
  EXPECT_NEAR(error.path_length, 49 * std::hypot(6 * std::sin(0.05), 0.05), 1e-12);
}

TEST(TrajectoryError, PositionErrorOfKnownSize) {
  // Points at +-1 on each axis moved outwards by 0.1 along x only: worked out by hand below.
  std::vector<StampedPose> reference(6), estimate(6);
  for (int i = 0; i < 6; ++i) {
    reference[i].stamp_ns = estimate[i].stamp_ns = i * 100 * kMillisecond;
    reference[i].map_from_camera.translation[i / 2] = i % 2 ? 1 : -1;
    estimate[i].map_from_camera.translation = reference[i].map_from_camera.translation;
  }
  estimate[0].map_from_camera.translation.x() = -1.1;
  estimate[1].map_from_camera.translation.x() = 1.1;
  const TrajectoryError error = evaluate_trajectory(reference, estimate, kTolerance);
  // Least squares scale: sum(r.e) / sum(e.e) = (2 * 1.1 + 4) / (2 * 1.21 + 4).
  const double scale = 6.2 / 6.42;
  EXPECT_NEAR(error.reference_from_estimate.scale, scale, 1e-12);
  const double along_x = 1.1 * scale - 1, else_ = 1 - scale;
  EXPECT_NEAR(error.position_max, std::max(along_x, else_), 1e-12);
  EXPECT_NEAR(error.position_median, else_, 1e-12);
  EXPECT_NEAR(error.position_rmse, std::sqrt((2 * along_x * along_x + 4 * else_ * else_) / 6), 1e-12);
  const double path = 2 + std::sqrt(2) + 2 + std::sqrt(2) + 2;
  EXPECT_NEAR(error.position_rmse_percent, 100 * error.position_rmse / path, 1e-12);
}

TEST(TrajectoryError, OneTurnedCamera) {
  const std::vector<StampedPose> reference = slow_walk(41);
  std::vector<StampedPose> estimate = seen_from(some_map(), reference);
  Rigid3& turned = estimate[20].map_from_camera;
  turned.rotation = turned.rotation * turn(10, {0, 1, 0});
  const TrajectoryError error = evaluate_trajectory(reference, estimate, kTolerance);
  // The mean rotation follows by about 1 / 41 of the 10 degrees.
  EXPECT_NEAR(error.rotation_max_deg, 10 * 40 / 41., 0.02);
  EXPECT_NEAR(error.rotation_median_deg, 10 / 41., 0.02);
  EXPECT_LT(error.relative_rotation_median_deg, 1e-5);
  EXPECT_LT(error.position_max, 1e-12);
}

TEST(TrajectoryError, CamerasThatAllLookElsewhere) {
  // Turned about their own axes by the same 5 degrees: no single rotation of the map can undo that, as they
  // look about.
  const std::vector<StampedPose> reference = slow_walk(41);
  std::vector<StampedPose> estimate = reference;
  for (StampedPose& pose : estimate) {
    pose.map_from_camera.rotation = pose.map_from_camera.rotation * turn(5, {1, 0, 0});
  }
  const TrajectoryError error = evaluate_trajectory(reference, estimate, kTolerance);
  // The steps are seen from frames that are turned by 5 degrees about x.
  std::vector<double> directions;
  for (std::size_t i = 0; i + 1 < reference.size(); ++i) {
    const Eigen::Vector3d step =
        (reference[i].map_from_camera.inverse() * reference[i + 1].map_from_camera).translation;
    const Eigen::Vector3d seen = turn(-5, {1, 0, 0}) * step;
    directions.push_back(std::acos(step.dot(seen) / step.squaredNorm()) * 180 / M_PI);
  }
  std::sort(directions.begin(), directions.end());
  EXPECT_NEAR(error.relative_direction_median_deg, 0.5 * (directions[19] + directions[20]), 1e-6);
  EXPECT_GT(error.rotation_median_deg, 0.5);
}

TEST(TrajectoryError, PathRunsOverAllReferenceFramesBetweenTheMatched) {
  const std::vector<StampedPose> reference = slow_walk(50);
  std::vector<StampedPose> estimate;
  for (int i = 10; i <= 30; i += 5) estimate.push_back(reference[i]);
  const TrajectoryError error = evaluate_trajectory(reference, estimate, kTolerance);
  EXPECT_EQ(error.frames_reference, 50);
  EXPECT_EQ(error.frames_matched, 5);
  EXPECT_NEAR(error.path_length, 20 * std::hypot(6 * std::sin(0.05), 0.05), 1e-12);
}

TEST(TrajectoryError, StampsMatchTheNearestWithinTheTolerance) {
  const std::vector<StampedPose> reference = slow_walk(10);
  std::vector<StampedPose> estimate = {reference[1], reference[2], reference[3], reference[4]};
  estimate[0].stamp_ns += 9 * kMillisecond;   // within
  estimate[1].stamp_ns -= 10 * kMillisecond;  // just within
  estimate[2].stamp_ns += 11 * kMillisecond;  // beyond
  EXPECT_EQ(evaluate_trajectory(reference, estimate, kTolerance).frames_matched, 3);
  // Of two that are near one reference frame the nearer counts, whatever the other says.
  StampedPose wrong = reference[4];
  wrong.stamp_ns += kMillisecond;
  wrong.map_from_camera.translation.x() += 100;
  estimate.push_back(wrong);
  const TrajectoryError error = evaluate_trajectory(reference, estimate, kTolerance);
  EXPECT_EQ(error.frames_matched, 3);
  EXPECT_LT(error.position_max, 1e-12);
}

TEST(TrajectoryError, StepsWithoutReferenceMotionHaveNoDirection) {
  std::vector<StampedPose> reference = slow_walk(11), estimate;
  for (int i = 6; i < 11; ++i) {
    reference[i].map_from_camera = Rigid3(turn(i, {0, 1, 0}), reference[5].map_from_camera.translation);
  }
  estimate = reference;
  for (int i = 6; i < 11; ++i) estimate[i].map_from_camera.translation.z() += 1e-9 * (i % 2);
  EXPECT_LT(evaluate_trajectory(reference, estimate, kTolerance).relative_direction_median_deg, 1e-3);
  // An estimate that stands still has no direction to be right about.
  for (int i = 1; i < 5; ++i)
    estimate[i].map_from_camera.translation = estimate[0].map_from_camera.translation;
  EXPECT_EQ(evaluate_trajectory(reference, estimate, kTolerance).relative_direction_median_deg, 180);
}

TEST(TrajectoryError, RefusesWhatCannotBeCompared) {
  const std::vector<StampedPose> reference = slow_walk(10);
  const std::vector<StampedPose> two(reference.begin(), reference.begin() + 2);
  expect_error([&] { evaluate_trajectory(reference, two, kTolerance); }, {"2 of 2", "expected 3"});
  expect_error([&] { evaluate_trajectory({}, reference, kTolerance); }, {"0 of 10", "expected 3"});
  expect_error([&] { evaluate_trajectory(reference, {}, kTolerance); }, {"0 of 0"});
  std::vector<StampedPose> still = reference;
  for (StampedPose& pose : still) pose.map_from_camera.translation.setOnes();
  expect_error([&] { evaluate_trajectory(reference, still, kTolerance); }, {"cannot be aligned", "expected"});
  expect_error([&] { evaluate_trajectory(still, reference, kTolerance); }, {"cannot be aligned", "expected"});
}

/// A straight way at constant speed along x; the estimate's unit grows on it by the given share.
std::vector<StampedPose> straight(int count, double growth) {
  std::vector<StampedPose> poses(count);
  double x = 0;
  for (int i = 0; i < count; ++i) {
    poses[i].stamp_ns = 100 * kMillisecond * i;
    poses[i].map_from_camera.translation = {x, 0.01 * std::sin(i), 0};
    x += 1 / (1 + growth * i / count);
  }
  return poses;
}

TEST(TrajectoryError, ScaleDriftIsThatOfTheUnit) {
  const TrajectoryError error = evaluate_trajectory(straight(400, 0), straight(400, 0.2), kTolerance);
  ASSERT_TRUE(error.scale_drift_percent);
  // The quarters' middles are 3/4 of the way apart: (1 + 0.2 * 0.875) / (1 + 0.2 * 0.125).
  EXPECT_NEAR(*error.scale_drift_percent, 100 * (1.175 / 1.025 - 1), 0.3);
  EXPECT_NEAR(*evaluate_trajectory(slow_walk(50), seen_from(some_map(), slow_walk(50)), kTolerance)
                   .scale_drift_percent,
              0, 1e-9);
}

TEST(TrajectoryError, DriftIsAShareOfThePath) {
  // A straight way whose estimate turns away by 0.01 degrees at each step of 1, the positions being right.
  const std::vector<StampedPose> reference = straight(101, 0);
  std::vector<StampedPose> estimate = reference;
  for (int i = 0; i < 101; ++i) estimate[i].map_from_camera.rotation = turn(0.01 * i, {0, 0, 1});
  const TrajectoryError error = evaluate_trajectory(reference, estimate, kTolerance);
  EXPECT_NEAR(error.drift_rotation_deg_per_length, 0.01, 1e-4);
  EXPECT_NEAR(error.rpe_rotation_rmse_deg, 0.01, 1e-6);
  // A camera with an orientation error of up to 1 degree has direction errors of its steps of up to as much.
  EXPECT_GT(error.drift_translation_percent, 0.1);
  EXPECT_LT(error.drift_translation_percent, 100 * M_PI / 180);
}

TEST(TrajectoryError, WithoutAScaleItIsAnError) {
  const std::vector<StampedPose> reference = slow_walk(50);
  Sim3 smaller;
  smaller.scale = 0.5;
  EvaluationOptions options;
  options.alignment = Alignment::kSe3;
  const TrajectoryError error = evaluate_trajectory(reference, seen_from(smaller, reference), options);
  EXPECT_EQ(error.reference_from_estimate.scale, 1);
  EXPECT_GT(error.position_rmse, 0.5);
  EXPECT_LT(evaluate_trajectory(reference, seen_from(smaller, reference), kTolerance).position_rmse, 1e-12);
}

TEST(TrajectoryError, UnitedMapsAreOnePicture) {
  const std::vector<StampedPose> all = slow_walk(50);
  const std::vector<StampedPose> first(all.begin(), all.begin() + 20), second(all.begin() + 20, all.end());
  const TrajectoryError error = united({evaluate_trajectory(all, seen_from(some_map(), second), kTolerance),
                                        evaluate_trajectory(all, first, kTolerance)});
  ASSERT_EQ(error.positions.size(), 50u);
  for (std::size_t i = 0; i < 50; ++i) EXPECT_EQ(error.positions[i].stamp_ns, all[i].stamp_ns);
  EXPECT_LT(error.position_rmse, 1e-12);
}

TrajectoryError two_lines(double distance) {
  TrajectoryError error;
  for (int i = 0; i < 10; ++i)
    error.positions.push_back({i * 1000000000ll, {1.0 * i, 0, 0}, {1.0 * i, 0, distance}});
  error.position_max = distance;
  return error;
}

TEST(TrajectoryPlot, ShowsBothAndTheirDistance) {
  TemporaryFolder folder;
  write_trajectory_plot(folder / "plot.png", two_lines(0.5));
  const cv::Mat apart = cv::imread(folder / "plot.png");
  ASSERT_FALSE(apart.empty());
  EXPECT_EQ(cv::norm(apart, draw_trajectory_plot(two_lines(0.5)), cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(apart, draw_trajectory_plot(two_lines(0.1)), cv::NORM_INF), 50);
}

TEST(TrajectoryPlot, NoErrorAtAllIsAPictureToo) { EXPECT_FALSE(draw_trajectory_plot(two_lines(0)).empty()); }

TEST(TrajectoryPlot, NoTitleIsCut) {
  TrajectoryError error = two_lines(0.5);
  error.position_rmse = 0.000590721;
  error.position_rmse_percent = 0.0543;
  const cv::Mat picture = draw_trajectory_plot(error);
  // The titles' line of the lower two diagrams: nothing is drawn where one ends and the other begins.
  cv::Mat ink;
  cv::inRange(picture(cv::Rect(680, 700, 40, 40)), cv::Scalar::all(0), cv::Scalar::all(128), ink);
  EXPECT_EQ(cv::countNonZero(ink), 0);
}

TEST(TrajectoryPlot, SaysWhenItCannotWrite) {
  expect_error([&] { write_trajectory_plot("/no/such/folder/plot.png", two_lines(1)); },
               {"/no/such/folder/plot.png"});
}

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
