// Saved and loaded maps.
#include <gtest/gtest.h>

#include <algorithm>

#include "mapping/depth_reversal.h"
#include "mono_pose_tracker/evaluation/trajectory_error.h"
#include "mono_pose_tracker/tracking/tracker.h"
#include "segmentation/segmenter.h"
#include "support/expect_error.h"
#include "support/simulated_room.h"
#include "support/synthetic_views.h"
#include "support/temporary_folder.h"
#include "tracking/tracker_impl.h"

namespace mono_pose_tracker {
namespace {

constexpr int kWalkFrames = 25;
constexpr int kFirstPart = 14;  // number of images of the map

SequenceOptions room_options(int width, int height) {
  SequenceOptions options;
  options.scene = SceneKind::kRoom;
  options.frames = kWalkFrames;
  options.camera = default_camera(SceneKind::kRoom, width, height);
  options.noise_grey_levels = 1;
  return options;
}

const SimulatedRoom& walked_room() {
  static const SimulatedRoom room = simulated_room(kWalkFrames, 1);
  return room;
}

void add_pose(const FrameReport& report, std::vector<StampedPose>* poses) {
  if (report.map_from_camera) poses->push_back({report.stamp_ns, *report.map_from_camera});
}

// The map of the first part of the room; its poses go to `poses`.
const SavedMaps& first_part(std::vector<StampedPose>* poses = nullptr) {
  static std::vector<StampedPose> known;
  static const SavedMaps saved = [] {
    Tracker tracker(TrackerOptions(), walked_room().camera, Tracker::Mapping::kInline);
    for (int i = 0; i < kFirstPart; ++i) {
      add_pose(tracker.process(walked_room().frames[i].stamp_ns, walked_room().frames[i].image), &known);
    }
    return *tracker.copy_maps();
  }();
  if (poses) *poses = known;
  return saved;
}

std::string bytes_of(const SavedMaps& saved) {
  const TemporaryFolder folder;
  write_map_file(folder / "a.map", saved);
  return folder.read("a.map");
}

TEST(SavedMaps, TheRunsThatSawAMapAreTold) {
  const SavedMaps& saved = first_part();
  ASSERT_EQ(saved.sessions.size(), 1u);
  EXPECT_EQ(saved.sessions[0].frames, kFirstPart);
  Tracker tracker(TrackerOptions(), walked_room().camera, Tracker::Mapping::kInline);
  tracker.load_maps(saved);
  for (int i = kFirstPart; i < kWalkFrames; ++i) {
    tracker.process(walked_room().frames[i].stamp_ns, walked_room().frames[i].image);
  }
  const SavedMaps grown = *tracker.copy_maps();
  ASSERT_EQ(grown.sessions.size(), 2u);
  EXPECT_EQ(grown.sessions[0].first_frame, -kFirstPart);
  EXPECT_EQ(grown.sessions[1].first_frame, 0);
  EXPECT_EQ(grown.sessions[1].frames, kWalkFrames - kFirstPart);
  int keyframes_of_second = 0;
  for (const auto& [id, keyframe] : grown.maps[0].keyframes()) {
    const bool second = grown.sessions[1].holds(keyframe.frame_index);
    keyframes_of_second += second;
    const auto& frame = walked_room().frames[keyframe.frame_index + kFirstPart];
    EXPECT_EQ(keyframe.stamp_ns, frame.stamp_ns) << "the number of an image in its run names it";
  }
  EXPECT_GT(keyframes_of_second, 0);
}

// The same place with a camera of other intrinsics and size.
TEST(SavedMaps, AnotherCameraGoesOnInTheMap) {
  std::vector<StampedPose> poses;
  const SavedMaps& saved = first_part(&poses);
  SequenceOptions options = room_options(400, 320);
  options.camera.fx *= 1.15;
  options.camera.fy *= 1.2;
  options.camera.distortion = {-0.05, 0.01, 0, 0, 0};
  const SimulatedSequence sequence(options);
  Tracker tracker(TrackerOptions(), sequence.camera(), Tracker::Mapping::kInline);
  tracker.load_maps(saved);
  int registered = 0;
  for (int i = kFirstPart; i < kWalkFrames; ++i) {
    const SimulatedFrame frame = sequence.render(i);
    const FrameReport report = tracker.process(frame.stamp_ns, frame.image);
    registered += report.map_from_camera.has_value();
    add_pose(report, &poses);
  }
  EXPECT_GE(registered, kWalkFrames - kFirstPart - 2) << "found within two images";
  // In the frame and unit of the first camera's map: one alignment for both.
  const TrajectoryError error = evaluate_trajectory(walked_room().truth, poses, 0);
  EXPECT_LT(error.rotation_median_deg, 0.8);
  EXPECT_LT(error.position_rmse_percent, 2);
  const SavedMaps grown = *tracker.copy_maps();
  ASSERT_EQ(grown.maps.size(), 1u);
  grown.maps[0].check();
  EXPECT_EQ(grown.sessions[0].camera, walked_room().camera.parameters());
  EXPECT_EQ(grown.sessions[1].camera, sequence.camera().parameters());
  EXPECT_GT(grown.maps[0].keyframes().size(), saved.maps[0].keyframes().size());
  // Points observed by both: the maps are one.
  int shared = 0;
  for (const auto& [id, landmark] : grown.maps[0].landmarks()) {
    const auto session = [&](const Observation& o) {
      return grown.maps[0].keyframe(o.keyframe)->frame_index < 0;
    };
    shared += session(landmark.observations.front()) != session(landmark.observations.back());
  }
  EXPECT_GT(shared, 40);
  ASSERT_TRUE(tracker.finish());
  tracker.map().check();
  const TemporaryFolder folder;
  write_map_file(folder / "a.map", *tracker.copy_maps());
  read_map_file(folder / "a.map", "root_sift").maps[0].check();
}

TEST(SavedMaps, AMapOfVersion1IsGoneOnIn) {
  const SimulatedSequence sequence(room_options(160, 120));
  Tracker tracker(TrackerOptions(), sequence.camera(), Tracker::Mapping::kInline);
  tracker.load_maps(read_map_file(TEST_DATA "/map_version_1.map", "root_sift"));
  std::vector<StampedPose> poses;
  for (int i = 4; i < 14; ++i) {
    const SimulatedFrame frame = sequence.render(i);
    add_pose(tracker.process(frame.stamp_ns, frame.image), &poses);
  }
  EXPECT_GE(poses.size(), 5u) << "found within five images";
  // The map has sixty features per image, with pixels of half a degree.
  EXPECT_LT(evaluate_trajectory(sequence.path(), poses, 0).rotation_median_deg, 1.5);
}

TEST(SavedMaps, LocalizingOnlyNeverChangesTheMap) {
  TrackerOptions options;
  options.localize_only = true;
  for (const auto mapping : {Tracker::Mapping::kInline, Tracker::Mapping::kThreaded}) {
    Tracker tracker(options, walked_room().camera, mapping);
    std::vector<StampedPose> poses;
    SavedMaps saved = first_part(&poses);
    tracker.load_maps(saved);
    const cv::Mat blank(240, 320, CV_8UC3, cv::Scalar::all(90));
    int registered = 0;
    for (int i = 0; i < kWalkFrames; ++i) {
      const FrameReport report =
          tracker.process(walked_room().frames[i].stamp_ns, walked_room().frames[i].image);
      registered += report.map_from_camera.has_value();
      EXPECT_FALSE(report.is_keyframe);
      if (i >= kFirstPart) add_pose(report, &poses);
    }
    EXPECT_GE(registered, kWalkFrames - 2);
    const TrajectoryError error = evaluate_trajectory(walked_room().truth, poses, 0);
    EXPECT_LT(error.position_rmse_percent, 2);
    // Lost for long: no additional map is begun.
    for (int i = 0; i < 2 * options.young_map_patience; ++i) tracker.process(1'000'000'000'000 + i, blank);
    ASSERT_TRUE(tracker.finish());
    tracker.impl().keep_for_later(0, walked_room().frames[0].stamp_ns, walked_room().frames[0].image);
    tracker.impl().fill_gaps();
    EXPECT_EQ(tracker.impl().maps().size(), 1u);
    EXPECT_EQ(tracker.trajectory().size(), static_cast<std::size_t>(kWalkFrames));
    saved.end_before_zero();
    EXPECT_EQ(bytes_of(*tracker.copy_maps()), bytes_of(saved));
  }
}

// A head viewed from afar that rotates by 3 degrees between keyframes.
SavedMaps narrow_map() {
  constexpr int kKeyframes = 6, kPoints = 100;
  Random random(3);
  const SyntheticScene scene = synthetic_head(kPoints, random);
  Map map;
  std::vector<LandmarkId> ids;
  for (const Eigen::Vector3d& x : scene.x_in_map) ids.push_back(map.add_landmark(x));
  for (int k = 0; k < kKeyframes; ++k) {
    add_view(scene, synthetic_camera(), before_turned_head(0.05 * k), 0.1, k, ids, random, &map);
  }
  return {"root_sift", {{synthetic_camera().parameters(), 0, kKeyframes}}, {map}};
}

TEST(SavedMaps, WhereNoImageIsFoundNoneIsRegisteredAgain) {
  Tracker tracker(TrackerOptions(), synthetic_camera(), Tracker::Mapping::kInline);
  tracker.load_maps(narrow_map());
  ASSERT_TRUE(tracker.finish());
  ASSERT_TRUE(is_narrow(tracker.map()));
  EXPECT_TRUE(tracker.impl().adjust_frames(*tracker.view()).empty());
}

TEST(SavedMaps, LocalizingOnlyBeginsNoMap) {
  TrackerOptions options;
  options.localize_only = true;
  Tracker tracker(options, walked_room().camera, Tracker::Mapping::kInline);
  for (int i = 0; i < 8; ++i) {
    const FrameReport report =
        tracker.process(walked_room().frames[i].stamp_ns, walked_room().frames[i].image);
    EXPECT_FALSE(report.map_from_camera);
    EXPECT_EQ(report.reason, Reason::kRelocalising);
    EXPECT_NE(report.reason_text.find("no map"), std::string::npos);
  }
  EXPECT_FALSE(tracker.finish());
}

TEST(SavedMaps, AnotherRecordingMayBeginInTheMap) {
  TrackerOptions options;
  options.localize_only = true;
  Tracker tracker(options, walked_room().camera, Tracker::Mapping::kInline);
  tracker.load_maps(first_part());
  for (int run = 0; run < 2; ++run) {
    const std::uint32_t epoch = tracker.epoch();
    FrameReport report;
    for (int i = 0; i < 5; ++i) {
      report = tracker.process(walked_room().frames[i].stamp_ns, walked_room().frames[i].image);
      EXPECT_EQ(report.epoch, epoch);
      EXPECT_GT(report.map_id, 0u);
    }
    EXPECT_TRUE(report.map_from_camera);
    EXPECT_EQ(tracker.trajectory().size(), 5u);
    tracker.restart();
    EXPECT_EQ(tracker.epoch(), epoch + 1);
    EXPECT_TRUE(tracker.trajectory().empty());
  }
}

// Lost for long in another place: that place gets an additional map, both are kept, and the camera
// relocalises in either.
TEST(SavedMaps, ANewMapIsBegunInAdditionToTheLoadedOne) {
  SequenceOptions elsewhere_options;
  elsewhere_options.scene = SceneKind::kPlane;
  elsewhere_options.frames = kWalkFrames;
  elsewhere_options.camera = walked_room().camera.parameters();
  elsewhere_options.seed = 3;
  const SimulatedSequence elsewhere(elsewhere_options);
  TrackerOptions options;
  options.young_map_keyframes = 3;
  Tracker tracker(options, walked_room().camera, Tracker::Mapping::kInline);
  tracker.load_maps(first_part());
  const auto show = [&](Tracker& shown_to, const cv::Mat& image) {
    static std::int64_t stamp = 0;
    return shown_to.process(++stamp, image);
  };
  FrameReport report;
  for (int i = 0; i < elsewhere.size(); ++i) report = show(tracker, elsewhere.render(i).image);
  ASSERT_EQ(report.state, State::kTracking) << report.reason_text;
  ASSERT_EQ(report.inactive_maps.size(), 1u) << "the loaded one";
  EXPECT_GT(report.map_id, report.inactive_maps[0]);
  const SavedMaps both = *tracker.copy_maps();
  ASSERT_EQ(both.maps.size(), 2u);
  EXPECT_EQ(both.sessions.size(), 2u);

  const TemporaryFolder folder;
  write_map_file(folder / "a.map", both);
  Tracker again(options, walked_room().camera, Tracker::Mapping::kInline);
  again.load_maps(read_map_file(folder / "a.map", "root_sift"));
  EXPECT_EQ(again.copy_maps()->maps.size(), 2u);
  for (const cv::Mat& image : {walked_room().frames[3].image, elsewhere.render(kWalkFrames - 1).image}) {
    FrameReport found;
    for (int i = 0; i < 5 && !found.map_from_camera; ++i) found = show(again, image);
    EXPECT_TRUE(found.map_from_camera) << found.reason_text;
    show(again, cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(90)));  // lost again
  }
}

// A moving object is separated from a static background there too, though no first map was begun.
TEST(SavedMaps, AnObjectIsFoundByItsMotionInAdditionToTheLoadedMap) {
  SequenceOptions head_options;
  head_options.scene = SceneKind::kHead;
  head_options.background = BackgroundKind::kTextured;
  head_options.frames = 120;
  head_options.camera = default_camera(SceneKind::kHead, 320, 240);
  const SimulatedSequence head(head_options);
  TrackerOptions options;
  options.young_map_keyframes = 3;
  Tracker tracker(options, CameraModel(head_options.camera), Tracker::Mapping::kInline);
  tracker.load_maps(first_part());
  FrameReport report;
  int by_motion = 0;
  for (int i = 0; i < 50; ++i) {
    report = tracker.process(1 + i, head.render(i).image);
    by_motion += report.map_from_camera && report.segmentation == Segmentation::kByMotion;
  }
  EXPECT_EQ(report.state, State::kTracking) << report.reason_text;
  EXPECT_GT(by_motion, 15);
}

TEST(SavedMaps, WhatCantBeGoneOnInIsRefused) {
  Tracker tracker(TrackerOptions(), walked_room().camera, Tracker::Mapping::kInline);
  SavedMaps saved = first_part();
  saved.descriptor = "sift";
  expect_error<std::invalid_argument>([&] { tracker.load_maps(saved); }, {"sift", "root_sift"});
  saved = first_part();
  saved.maps.clear();
  expect_error<std::invalid_argument>([&] { tracker.load_maps(saved); }, {"no map"});
  EXPECT_EQ(tracker.epoch(), 0u) << "nothing has changed";
}

}  // namespace
}  // namespace mono_pose_tracker
