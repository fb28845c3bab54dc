#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "mono_pose_tracker/evaluation/trajectory_error.h"
#include "mono_pose_tracker/tracking/tracker.h"
#include "support/expect_error.h"
#include "support/simulated_room.h"

#ifdef MONO_POSE_TRACKER_WITH_ARUCO
#include <opencv2/aruco.hpp>
#endif

namespace mono_pose_tracker {
namespace {

constexpr int kScaleFrames = 25;

// The room, rendered once.
const SimulatedRoom& scale_room() {
  static const SimulatedRoom room = simulated_room(kScaleFrames, SequenceOptions().noise_grey_levels);
  return room;
}

struct Result {
  std::vector<StampedPose> poses;
  std::vector<KeyframePose> first_views;  // the first keyframes of the map
  ScaleSource scale = ScaleSource::kMapUnits;
  double true_scale = 0;  // metres in a unit of the map
};

Result track(const TrackerOptions& options, const std::vector<cv::Mat>& images) {
  Tracker tracker(options, scale_room().camera, Tracker::Mapping::kInline);
  Result result;
  for (int i = 0; i < kScaleFrames; ++i) {
    const FrameReport report = tracker.process(scale_room().frames[i].stamp_ns, images[i]);
    if (!report.map_from_camera) continue;
    if (result.poses.empty()) result.first_views = tracker.snapshot()->keyframes;
    result.poses.push_back({report.stamp_ns, *report.map_from_camera});
    result.scale = report.scale;
  }
  result.true_scale = evaluate_trajectory(scale_room().truth, result.poses, 0).reference_from_estimate.scale;
  return result;
}

std::vector<cv::Mat> plain_images() {
  std::vector<cv::Mat> images;
  for (const SimulatedFrame& frame : scale_room().frames) images.push_back(frame.image);
  return images;
}

Eigen::Vector3d true_position(std::int64_t stamp_ns) {
  for (const StampedPose& pose : scale_room().truth) {
    if (pose.stamp_ns == stamp_ns) return pose.map_from_camera.translation;
  }
  throw std::logic_error("no such stamp");
}

TEST(Scale, NothingKnownIsMapUnits) {
  const Result result = track(TrackerOptions(), plain_images());
  EXPECT_EQ(result.scale, ScaleSource::kMapUnits);
}

// The short path determines its scale to some per cent only: the test is for metres.
TEST(Scale, AKnownBaselineSetsMetres) {
  const Result plain = track(TrackerOptions(), plain_images());
  TrackerOptions options;
  options.scale.known_baseline =
      (true_position(plain.first_views.front().stamp_ns) - true_position(plain.first_views.back().stamp_ns))
          .norm();
  const Result result = track(options, plain_images());
  EXPECT_EQ(result.scale, ScaleSource::kKnownBaseline);
  EXPECT_NEAR(result.true_scale, 1, 0.05);
  const double baseline = (result.first_views.front().map_from_camera.translation -
                           result.first_views.back().map_from_camera.translation)
                              .norm();
  EXPECT_NEAR(baseline, options.scale.known_baseline, 0.02 * options.scale.known_baseline);
}

TEST(Scale, TheFirstMedianDepthSetsTheUnit) {
  const Result plain = track(TrackerOptions(), plain_images());
  TrackerOptions options;
  options.scale.initial_median_depth = 4;
  const Result result = track(options, plain_images());
  EXPECT_EQ(result.scale, ScaleSource::kInitialMedianDepth);
  EXPECT_NEAR(plain.true_scale / result.true_scale, 4, 0.04);
}

TEST(Scale, OneLengthAtMost) {
  TrackerOptions options;
  options.scale.initial_median_depth = 4;
  options.scale.known_baseline = 0.1;
  expect_error<std::invalid_argument>([&] { options.validate(); },
                                      {"scale/known_baseline", "expected one of them at most"});
  options.scale.known_baseline = 0;
  EXPECT_NO_THROW(options.validate());
  options.scale.odometry = true;
  expect_error<std::invalid_argument>([&] { options.validate(); },
                                      {"scale/odometry", "expected one of them at most"});
}

#ifdef MONO_POSE_TRACKER_WITH_ARUCO

// The images with a marker in the room, 1.5 m in front of the first camera.
std::vector<cv::Mat> images_with_marker(double side) {
  cv::Mat marker;
  cv::aruco::drawMarker(cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50), 3, 480, marker);
  cv::copyMakeBorder(marker, marker, 80, 80, 80, 80, cv::BORDER_CONSTANT, cv::Scalar(255));
  cv::cvtColor(marker, marker, cv::COLOR_GRAY2BGR);
  const std::vector<cv::Point2f> corners = {
      {79.5f, 79.5f}, {559.5f, 79.5f}, {559.5f, 559.5f}, {79.5f, 559.5f}};
  const Rigid3& map_from_first = scale_room().truth.front().map_from_camera;
  std::vector<cv::Mat> images = plain_images();
  for (int i = 0; i < kScaleFrames; ++i) {
    std::vector<cv::Point2f> quad;
    for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
      const Eigen::Vector3d x_in_first(0.5 * side * x, 0.5 * side * y, 1.5);
      Eigen::Vector2d pixel;
      const Rigid3 camera_from_map = scale_room().truth[i].map_from_camera.inverse();
      if (!scale_room().camera.project(camera_from_map * (map_from_first * x_in_first), &pixel)) {
        throw std::logic_error("the marker is behind the camera");
      }
      quad.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
    }
    images[i] = images[i].clone();
    // Drawn at four times the size and reduced, as a sensor's pixels average.
    cv::Mat large;
    cv::resize(images[i], large, {}, 4, 4, cv::INTER_NEAREST);
    for (cv::Point2f& p : quad) p = {4 * p.x + 1.5f, 4 * p.y + 1.5f};
    cv::warpPerspective(marker, large, cv::getPerspectiveTransform(corners, quad), large.size(),
                        cv::INTER_LINEAR, cv::BORDER_TRANSPARENT);
    cv::resize(large, images[i], images[i].size(), 0, 0, cv::INTER_AREA);
  }
  return images;
}

TEST(Scale, AMarkerSetsMetres) {
  TrackerOptions options;
  options.scale.marker_size = 0.4;
  options.scale.marker_id = 3;
  const Result result = track(options, images_with_marker(0.4));
  EXPECT_EQ(result.scale, ScaleSource::kMarker);
  EXPECT_NEAR(result.true_scale, 1, 0.05);
  const Result without = track(options, plain_images());
  EXPECT_EQ(without.scale, ScaleSource::kMapUnits) << "no marker, no metres";
}

TEST(Scale, AMarkerThatIsSeenLaterSetsMetres) {
  constexpr int kHungUpAfter = 12;
  TrackerOptions options;
  options.scale.marker_size = 0.4;
  options.scale.marker_id = 3;
  options.mapping.keyframe_parallax_deg = 1;  // enough keyframes in the rest of a short path
  std::vector<cv::Mat> images = plain_images(), later = images_with_marker(0.4);
  std::copy(later.begin() + kHungUpAfter, later.end(), images.begin() + kHungUpAfter);
  Tracker tracker(options, scale_room().camera, Tracker::Mapping::kInline);
  std::vector<StampedPose> in_units, in_metres;
  for (int i = 0; i < kScaleFrames; ++i) {
    const FrameReport report = tracker.process(scale_room().frames[i].stamp_ns, images[i]);
    if (!report.map_from_camera) continue;
    const bool is_metric = report.scale == ScaleSource::kMarker;
    EXPECT_EQ(is_metric, report.corrections == 1) << "with the correction, and once";
    (is_metric ? in_metres : in_units).push_back({report.stamp_ns, *report.map_from_camera});
    if (!report.corrected.empty()) {
      EXPECT_EQ(in_metres.size(), 1u);
      EXPECT_GT(report.corrected.size(), in_units.size()) << "frames from before are told anew";
    }
  }
  EXPECT_GE(in_units.size(), 5u) << "the map had begun without it";
  ASSERT_GE(in_metres.size(), 4u);
  std::vector<StampedPose> all;
  for (const RegisteredFrame& frame : tracker.trajectory())
    all.push_back({frame.stamp_ns, frame.map_from_camera});
  EXPECT_NEAR(evaluate_trajectory(scale_room().truth, all, 0).reference_from_estimate.scale, 1, 0.03);
  for (std::size_t i = 1; i < in_metres.size(); ++i) {
    const double step =
        (in_metres[i].map_from_camera.translation - in_metres[i - 1].map_from_camera.translation).norm();
    const double true_step =
        (true_position(in_metres[i].stamp_ns) - true_position(in_metres[i - 1].stamp_ns)).norm();
    EXPECT_NEAR(step, true_step, 0.2 * true_step) << "the scale of a report is that of its pose";
  }
}

#endif

TEST(Scale, AMapThatIsMovedAsAWholeTakesAllWithIt) {
  constexpr int kMovedAfter = 15;
  const Sim3 moved_from_map(2.5, Eigen::Quaterniond(Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitY())),
                            {3, -1, 2});
  Tracker left_alone(TrackerOptions(), scale_room().camera, Tracker::Mapping::kInline);
  Tracker moved(TrackerOptions(), scale_room().camera, Tracker::Mapping::kInline);
  moved.transform_map(moved_from_map, ScaleSource::kOdometry);  // without a map: nothing
  for (int i = 0; i < kScaleFrames; ++i) {
    const std::int64_t stamp_ns = scale_room().frames[i].stamp_ns;
    const FrameReport expected = left_alone.process(stamp_ns, scale_room().frames[i].image);
    const FrameReport report = moved.process(stamp_ns, scale_room().frames[i].image);
    ASSERT_EQ(report.map_from_camera.has_value(), expected.map_from_camera.has_value()) << i;
    EXPECT_EQ(report.corrections, i > kMovedAfter ? 1u : 0u);
    if (i == kMovedAfter) {
      ASSERT_TRUE(report.map_from_camera);
      moved.transform_map(moved_from_map, ScaleSource::kOdometry);
    }
    if (i <= kMovedAfter || !report.map_from_camera) continue;
    EXPECT_EQ(report.scale, ScaleSource::kOdometry);
    EXPECT_EQ(report.corrected.empty(), i != kMovedAfter + 1)
        << "what was reported before is told anew, once";
    const Rigid3& pose = *expected.map_from_camera;
    EXPECT_LT((report.map_from_camera->translation - moved_from_map * pose.translation).norm(), 0.02);
    EXPECT_LT(
        rotation_angle_between(report.map_from_camera->rotation, moved_from_map.rotation * pose.rotation),
        0.002);
  }
}

}  // namespace
}  // namespace mono_pose_tracker
