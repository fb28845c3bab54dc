#include "mono_pose_tracker/tracking/tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <set>
#include <thread>

#include "mapping/mapping_worker.h"
#include "support/random_texture.h"
#include "support/simulated_room.h"
#include "support/temporary_folder.h"
#include "tracking/map_snapshot.h"
#include "tracking/tracker_impl.h"

namespace mono_pose_tracker {
namespace {

TEST(Tracker, PosesEveryImageOfARecording) {
  Tracker tracker(TrackerOptions(), room().camera, Tracker::Mapping::kInline);
  const std::vector<FrameReport> reports = track_all(&tracker);
  ASSERT_EQ(reports.size(), static_cast<std::size_t>(kFrames));
  EXPECT_EQ(reports[0].reason, Reason::kFirstFrame);
  for (int i = 0; i < kFrames; ++i) {
    EXPECT_EQ(reports[i].stamp_ns, room().frames[i].stamp_ns);
    EXPECT_EQ(reports[i].worker_backlog, 0);
    expect_consistent(reports[i]);
  }
  const std::vector<StampedPose> live = registered_poses(reports);
  EXPECT_GE(live.size(), kFrames - 8u);
  expect_accurate(live, 0.8, 2);

  ASSERT_TRUE(tracker.finish());
  tracker.map().check();
  for (int i = 0; i < kFrames; ++i) {
    const auto trajectory = tracker.trajectory();
    const bool known = std::any_of(trajectory.begin(), trajectory.end(),
                                   [&](const RegisteredFrame& frame) { return frame.index == i; });
    if (!known) tracker.impl().register_image_again(i, room().frames[i].stamp_ns, room().frames[i].image);
  }
  const std::vector<RegisteredFrame> trajectory = tracker.trajectory();
  ASSERT_EQ(trajectory.size(), static_cast<std::size_t>(kFrames));
  for (int i = 0; i < kFrames; ++i) EXPECT_EQ(trajectory[i].index, i);
  expect_accurate(registered_poses(trajectory), 0.4, 1);
  EXPECT_TRUE(tracker.impl().adjust_frames(*tracker.view()).empty()) << "all agree with the map";
  expect_accurate(registered_poses(tracker.trajectory()), 0.4, 1);
  const std::shared_ptr<const MapSnapshot> all = tracker.snapshot();
  EXPECT_EQ(all->points.size(), tracker.map().landmarks().size());
  const MapSnapshot newest = newest_view_of(tracker.view());
  ASSERT_EQ(newest.keyframes.size(), 1u);
  EXPECT_EQ(newest.keyframes[0].stamp_ns, all->keyframes.back().stamp_ns);
  EXPECT_EQ(newest.revision, all->revision);
  EXPECT_GT(newest.points.size(), 10u);
  EXPECT_LT(newest.points.size(), all->points.size()) << "what it sees, not the whole map";
}

TEST(Tracker, AnImageThatTheFinishedMapDoesNotRegisterHasNoPose) {
  Tracker tracker(TrackerOptions(), room().camera, Tracker::Mapping::kInline);
  track_all(&tracker);
  ASSERT_TRUE(tracker.finish());
  std::set<std::int64_t> of_keyframes;
  for (const auto& entry : tracker.map().keyframes()) of_keyframes.insert(entry.second.frame_index);
  const std::vector<RegisteredFrame> all = tracker.trajectory();
  const auto between = std::find_if(all.rbegin(), all.rend(), [&](const RegisteredFrame& frame) {
    return !of_keyframes.count(frame.index);
  });
  ASSERT_NE(between, all.rend());
  const std::int64_t index = between->index;
  const auto is_registered = [&] {
    const std::vector<RegisteredFrame> trajectory = tracker.trajectory();
    return std::any_of(trajectory.begin(), trajectory.end(),
                       [&](const RegisteredFrame& frame) { return frame.index == index; });
  };
  const SimulatedFrame& frame = room().frames[index];
  EXPECT_TRUE(tracker.impl().register_image_again(index, frame.stamp_ns, frame.image).map_from_camera);
  EXPECT_TRUE(is_registered());
  cv::Mat other;
  cv::cvtColor(random_texture(frame.image.cols, frame.image.rows, 5), other, cv::COLOR_GRAY2BGR);
  EXPECT_FALSE(tracker.impl().register_image_again(index, frame.stamp_ns, other).map_from_camera);
  EXPECT_FALSE(is_registered());
  const std::size_t left = tracker.trajectory().size();
  const std::int64_t keyframe = *of_keyframes.rbegin();
  EXPECT_FALSE(
      tracker.impl().register_image_again(keyframe, room().frames[keyframe].stamp_ns, other).map_from_camera);
  EXPECT_EQ(tracker.trajectory().size(), left) << "the map still has the keyframe";
}

TEST(Tracker, TheFirstPoseSaysWhatTheMapWasBegunWith) {
  Tracker tracker(TrackerOptions(), room().camera, Tracker::Mapping::kInline);
  const std::vector<FrameReport> reports = track_all(&tracker);
  const auto first = std::find_if(reports.begin(), reports.end(), [](const FrameReport& report) {
    return report.map_from_camera.has_value();
  });
  ASSERT_NE(first, reports.end());
  EXPECT_EQ(first->reason_text.rfind("map of ", 0), 0u) << first->reason_text;
  EXPECT_NE(first->reason_text.find("points from"), std::string::npos) << first->reason_text;
}

// A sticker on the lens.
TEST(Tracker, WhatIsFixedToTheCameraIsNoPartOfTheMap) {
  const cv::Rect place(90, 160, 140, 60);
  cv::Mat sticker;
  cv::cvtColor(random_texture(place.width, place.height, 3), sticker, cv::COLOR_GRAY2BGR);
  Tracker tracker(TrackerOptions(), room().camera, Tracker::Mapping::kInline);
  for (const SimulatedFrame& frame : room().frames) {
    cv::Mat image = frame.image.clone();
    sticker.copyTo(image(place));
    tracker.process(frame.stamp_ns, image);
  }
  ASSERT_TRUE(tracker.finish());
  int on_sticker = 0, others = 0;
  for (const auto& [id, keyframe] : tracker.map().keyframes()) {
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
      if (keyframe.landmark_of_feature[f] == kNoLandmark) continue;
      const Eigen::Vector2f& pixel = keyframe.image->set.features[f].pixel;
      ++(place.contains({static_cast<int>(pixel.x()), static_cast<int>(pixel.y())}) ? on_sticker : others);
    }
  }
  EXPECT_GT(others, 500);
  EXPECT_LT(on_sticker, 0.02 * others);
  const std::vector<RegisteredFrame> trajectory = tracker.trajectory();
  EXPECT_GE(trajectory.size(), kFrames - 8u);
  expect_accurate(registered_poses(trajectory), 0.8, 2);
}

TEST(Tracker, OneSeedGivesOneResult) {
  std::vector<std::vector<StampedPose>> runs;
  for (int run = 0; run < 2; ++run) {
    Tracker tracker(TrackerOptions(), room().camera, Tracker::Mapping::kInline);
    runs.push_back(registered_poses(track_all(&tracker)));
  }
  ASSERT_EQ(runs[0].size(), runs[1].size());
  for (std::size_t i = 0; i < runs[0].size(); ++i) {
    EXPECT_EQ(runs[0][i].map_from_camera.translation, runs[1][i].map_from_camera.translation);
    EXPECT_EQ(runs[0][i].map_from_camera.rotation.coeffs(), runs[1][i].map_from_camera.rotation.coeffs());
  }
}

TEST(Tracker, ThreadedMappingAnswersEveryImage) {
  Tracker tracker(TrackerOptions(), room().camera, Tracker::Mapping::kThreaded);
  const std::vector<FrameReport> reports = track_all(&tracker);
  ASSERT_EQ(reports.size(), static_cast<std::size_t>(kFrames));
  for (const FrameReport& report : reports) expect_consistent(report);
  const std::vector<StampedPose> live = registered_poses(reports);
  EXPECT_GE(live.size(), kFrames - 8u);
  expect_accurate(live, 0.8, 2);
}

// Matches without a common geometry: a million samples of five, a minute of work on the mapper's thread.
TEST(Tracker, EndsSoonWhateverItsOptionsAre) {
  TrackerOptions options;
  options.max_iterations = 1000000;
  options.confidence = 0.999999999;
  options.matching.min_ratio = 1;
  options.inlier_threshold_px = 0.1;
  options.bootstrap.max_rotation_only = 1;
  std::mutex mutex;
  std::condition_variable changed;
  int jobs = 0;
  auto tracker = std::make_unique<Tracker>(options, room().camera, Tracker::Mapping::kThreaded, [&] {
    const std::lock_guard<std::mutex> lock(mutex);
    ++jobs;
    changed.notify_all();
  });
  tracker->process(0, random_texture(320, 240, 1));
  tracker->wait();
  tracker->process(1, random_texture(320, 240, 2));
  {
    std::unique_lock<std::mutex> lock(mutex);
    ASSERT_TRUE(changed.wait_for(lock, std::chrono::seconds(60), [&] { return jobs == 2; }));
  }
  const auto start = std::chrono::steady_clock::now();
  tracker.reset();
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  EXPECT_LT(seconds.count(), 10) << "on a machine with nothing else to do it takes well below one";
}

// Blocks the mapper's thread before a job, until released.
class Gate {
 public:
  void pass() {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return open_; });
  }
  void set(bool open) {
    const std::lock_guard<std::mutex> lock(mutex_);
    open_ = open;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool open_ = true;
};

TEST(Tracker, MappingThatStandsStillNeverBlocksTracking) {
  Gate gate;
  Tracker tracker(TrackerOptions(), room().camera, Tracker::Mapping::kThreaded, [&gate] { gate.pass(); });
  int index = 0;
  const auto next = [&] {
    const SimulatedFrame& frame = room().frames[index++];
    return tracker.process(frame.stamp_ns, frame.image);
  };
  while (index < kFrames - 8 && !next().map_from_camera) tracker.wait();
  // The map exists. From now on no job ends: a call that waits for one would never return.
  gate.set(false);
  const std::uint64_t revision = tracker.revision();
  int registered_frames = 0, keyframes = 0;
  for (int i = 0; i < 8; ++i) {
    const FrameReport report = next();
    registered_frames += report.map_from_camera.has_value();
    keyframes += report.is_keyframe;
    EXPECT_LE(report.worker_backlog, MappingWorkerOptions().most_waiting + 1);
    expect_consistent(report);
  }
  EXPECT_EQ(registered_frames, 8) << "against the map as it was";
  EXPECT_GE(keyframes, 1);
  EXPECT_EQ(tracker.revision(), revision);
  gate.set(true);
  tracker.wait();
  EXPECT_GT(tracker.revision(), revision) << "what waited has been done";
  tracker.map().check();
}

// The map's unit changes at any time while a frame is processed: it is registered, stored and reported in one
// map or the other.
TEST(Tracker, AFrameKeepsItsPlaceWhileTheMapIsRescaled) {
  std::atomic<int> delay_us{0};
  Tracker tracker(TrackerOptions(), room().camera, Tracker::Mapping::kThreaded,
                  [&] { std::this_thread::sleep_for(std::chrono::microseconds(delay_us)); });
  for (int i = 0; i < kFrames / 2; ++i) {
    tracker.process(room().frames[i].stamp_ns, room().frames[i].image);
    tracker.wait();
  }
  TrackerOptions options;
  options.localize_only = true;  // nothing else changes the map
  tracker.set_options(options);
  double told_scale = 1, scale = 1;
  int compared = 0;
  for (int step = 0; step < 3 * kFrames; ++step) {
    const int back_and_forth = std::abs(step % kFrames - kFrames / 2);
    const SimulatedFrame& frame = room().frames[back_and_forth];
    const double factor = step % 2 == 0 ? 2 : 0.5;
    delay_us = 300 * (step % 40);
    tracker.transform_map(Sim3(factor, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()),
                          std::nullopt);
    scale *= factor;
    const FrameReport report = tracker.process(1000 + step, frame.image);
    told_scale *= report.length_scale;
    tracker.wait();
    if (!report.map_from_camera) continue;
    const RegisteredFrame stored = tracker.trajectory().back();
    ASSERT_EQ(stored.stamp_ns, 1000 + step);
    const Eigen::Vector3d told = report.map_from_camera->translation * (scale / told_scale);
    EXPECT_LT((stored.map_from_camera.translation - told).norm(), 1e-6 * told.norm()) << step;
    ++compared;
  }
  EXPECT_GT(compared, 2 * kFrames);
  told_scale *= tracker.process(9000, room().frames[0].image).length_scale;
  EXPECT_DOUBLE_EQ(told_scale, scale);
}

TEST(Tracker, BootstrapThatStandsStillNeverBlocksTracking) {
  Gate gate;
  gate.set(false);
  Tracker tracker(TrackerOptions(), room().camera, Tracker::Mapping::kThreaded, [&gate] { gate.pass(); });
  for (int i = 0; i < 5; ++i) {
    const FrameReport report = tracker.process(room().frames[i].stamp_ns, room().frames[i].image);
    EXPECT_EQ(report.state, State::kBootstrapping);
    EXPECT_EQ(report.worker_backlog, 1) << "frames are passed over, not queued";
  }
  tracker.reset();
  gate.set(true);
  tracker.wait();
  const FrameReport after = tracker.process(room().frames[5].stamp_ns, room().frames[5].image);
  EXPECT_EQ(after.reason, Reason::kFirstFrame) << "what was under way belonged to the epoch before";
  EXPECT_EQ(after.epoch, 1u);
}

TEST(Tracker, ResetBeginsANewMap) {
  for (const auto mapping : {Tracker::Mapping::kInline, Tracker::Mapping::kThreaded}) {
    Tracker tracker(TrackerOptions(), room().camera, mapping);
    ASSERT_FALSE(registered_poses(track_all(&tracker)).empty());
    tracker.reset();
    EXPECT_TRUE(tracker.trajectory().empty());
    EXPECT_TRUE(tracker.snapshot()->points.empty());
    tracker.wait();
    const std::vector<FrameReport> again = track_all(&tracker);
    EXPECT_EQ(again[0].reason, Reason::kFirstFrame);
    for (const FrameReport& report : again) EXPECT_EQ(report.epoch, 1u);
    expect_accurate(registered_poses(again), 0.8, 2);
  }
}

// The drawn features add up to the numbers of the report.
TEST(Tracker, EveryFeatureIsSeenWithItsFate) {
  Tracker tracker(TrackerOptions(), room().camera, Tracker::Mapping::kInline);
  for (const FrameReport& report : track_all(&tracker)) {
    EXPECT_EQ(static_cast<int>(report.seen.size()), report.features);
    int inliers = 0, matched = 0;
    for (const SeenFeature& feature : report.seen) {
      inliers += feature.fate == SeenFeature::Fate::kInlier;
      matched += feature.fate != SeenFeature::Fate::kUnmatched;
      EXPECT_EQ(feature.landmark >= 0, feature.fate == SeenFeature::Fate::kInlier);
    }
    if (!report.map_from_camera) {
      EXPECT_EQ(static_cast<int>(report.motions.size()),
                report.reason == Reason::kFirstFrame ? 0 : report.matches);
      continue;
    }
    EXPECT_EQ(inliers, report.inliers);
    EXPECT_EQ(matched, report.matches);
    EXPECT_TRUE(report.motions.empty());
  }
}

TEST(Tracker, GoesOnInASavedMap) {
  for (const auto mapping : {Tracker::Mapping::kInline, Tracker::Mapping::kThreaded}) {
    // Saved after two thirds of the recording; another tracker continues with the last third.
    const std::size_t part = 2 * kFrames / 3;
    Tracker first(TrackerOptions(), room().camera, mapping);
    EXPECT_FALSE(first.copy_maps()) << "there is none yet";
    std::vector<StampedPose> poses;
    for (std::size_t i = 0; i < part; ++i) {
      const FrameReport report = first.process(room().frames[i].stamp_ns, room().frames[i].image);
      first.wait();  // a fast camera may have no map yet
      if (report.map_from_camera) poses.push_back({report.stamp_ns, *report.map_from_camera});
    }
    const TemporaryFolder folder;
    const std::optional<SavedMaps> saved = first.copy_maps();
    ASSERT_TRUE(saved);
    write_map_file(folder / "a.map", *saved);

    Tracker second(TrackerOptions(), room().camera, mapping);
    second.process(0, room().frames[0].image);
    second.load_maps(read_map_file(folder / "a.map", "root_sift"));
    EXPECT_EQ(second.epoch(), 1u);
    EXPECT_EQ(second.snapshot()->points.size(), first.snapshot()->points.size());
    const cv::Mat blank(240, 320, CV_8UC3, cv::Scalar::all(90));
    for (int i = 1; i <= 2 * TrackerOptions().young_map_patience; ++i) {
      const FrameReport lost = second.process(i, blank);
      EXPECT_EQ(lost.state, State::kLost) << "a saved map is not dropped, however young";
      EXPECT_EQ(lost.reason, Reason::kRelocalising);
    }
    for (int i = static_cast<int>(part); i < kFrames; ++i) {
      const FrameReport report = second.process(room().frames[i].stamp_ns, room().frames[i].image);
      second.wait();
      const State expected = i == static_cast<int>(part) ? State::kLost : State::kTracking;
      EXPECT_EQ(report.state, expected) << "a second view has to agree: " << report.reason_text;
      EXPECT_EQ(report.epoch, 1u);
      if (report.map_from_camera) poses.push_back({report.stamp_ns, *report.map_from_camera});
    }
    expect_accurate(poses, 0.8, 2);  // both parts in one map: one alignment
    const std::optional<SavedMaps> grown = second.copy_maps();
    ASSERT_TRUE(grown);
    grown->maps[0].check();
    EXPECT_GT(grown->maps[0].keyframes().rbegin()->first, saved->maps[0].keyframes().rbegin()->first)
        << "mapping goes on";
    EXPECT_EQ(second.trajectory().size(), kFrames - part);
    ASSERT_TRUE(second.finish());
    second.map().check();
  }
}

TEST(Tracker, ImageOfAnotherSizeIsNamed) {
  Tracker tracker(TrackerOptions(), room().camera, Tracker::Mapping::kInline);
  const FrameReport report = tracker.process(5, cv::Mat(120, 160, CV_8UC1, cv::Scalar(0)));
  EXPECT_EQ(report.reason, Reason::kImageSizeMismatch);
  EXPECT_EQ(report.stamp_ns, 5);
  EXPECT_FALSE(report.map_from_camera);
  EXPECT_NE(report.reason_text.find("160x120"), std::string::npos) << report.reason_text;
  EXPECT_NE(report.reason_text.find("320x240"), std::string::npos) << report.reason_text;
}

TEST(Tracker, NoImagesNoMap) {
  Tracker tracker(TrackerOptions(), room().camera, Tracker::Mapping::kThreaded);
  EXPECT_FALSE(tracker.finish());
  EXPECT_TRUE(tracker.trajectory().empty());
  EXPECT_EQ(tracker.revision(), 0u);
}

// A walk back and forth has many more keyframes than the map may keep.
TEST(Tracker, ACappedMapIsTrackedInAsWell) {
  TrackerOptions options;
  options.mapping.max_keyframes = 10;
  options.mapping.keyframe_parallax_deg = 0.5;
  options.mapping.redundant_overlap = 1.01;
  options.mapping.bundle_seconds = 1e9;  // a busy machine changes nothing
  Tracker tracker(options, room().camera, Tracker::Mapping::kThreaded);
  std::vector<FrameReport> reports;
  int most = 0, keyframes = 0;
  for (int step = 0; step < 2 * kFrames; ++step) {
    const SimulatedFrame& frame = room().frames[step < kFrames ? step : 2 * kFrames - 1 - step];
    reports.push_back(tracker.process(step, frame.image));
    tracker.wait();
    most = std::max(most, reports.back().keyframes);
    keyframes += reports.back().is_keyframe;
  }
  EXPECT_GT(keyframes, 15) << "or there is nothing to be taken out";
  EXPECT_LE(most, 10);
  tracker.map().check();
  // Each image has the same pose on the way back.
  int compared = 0;
  for (int i = 0; i < kFrames; ++i) {
    const auto &there = reports[i].map_from_camera, &back = reports[2 * kFrames - 1 - i].map_from_camera;
    EXPECT_TRUE(back) << i << ": " << reports[2 * kFrames - 1 - i].reason_text;
    if (!there || !back) continue;
    ++compared;
    EXPECT_LT(there->rotation.angularDistance(back->rotation), 0.01) << i;
    EXPECT_LT((there->translation - back->translation).norm(), 0.02) << i << ", of a depth of 1";
  }
  EXPECT_GT(compared, kFrames - 8);
  EXPECT_GE(tracker.trajectory().size(), registered_poses(reports).size())
      << "frames ride on keyframes that are gone";
}

}  // namespace
}  // namespace mono_pose_tracker
