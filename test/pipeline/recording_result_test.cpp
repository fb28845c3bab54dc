#include "pipeline/recording_result.h"

#include <gtest/gtest.h>

#include <initializer_list>
#include <numeric>
#include <set>
#include <vector>

#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

// An unconfirmed result. edges: of the view graph, each with this number of matches, of which so many are
// explained.
RecordingResult result_of(std::size_t images, int edges, int matches, int explained) {
  RecordingResult result;
  result.tracked = true;
  for (std::size_t i = 0; i < images; ++i) {
    const auto index = static_cast<std::int64_t>(i);
    result.trajectory.push_back({index, index, Rigid3()});
  }
  FinishedMap map;
  map.trajectory = result.trajectory;
  map.explained.edges = edges;
  map.explained.all = edges * matches;
  map.explained.explained = edges * explained;
  Finding finding;
  finding.kind = FindingKind::kUncertainPath;
  map.quality.add(finding);
  result.maps.push_back(map);
  return result;
}

TEST(ResultChoice, OneThatExplainsItsMatchesIsBetter) {
  EXPECT_TRUE(is_better(result_of(60, 300, 400, 390), result_of(60, 300, 400, 300)));
  EXPECT_FALSE(is_better(result_of(60, 300, 400, 300), result_of(60, 300, 400, 390)));
}

TEST(ResultChoice, OneOfAMaskedObjectIsBetterThanOneThatContradictsItself) {
  EXPECT_TRUE(is_better(result_of(60, 300, 82, 80), result_of(60, 300, 600, 400)));
}

TEST(ResultChoice, AMapOfFewLandmarksIsNotBetterForExplainingThem) {
  EXPECT_FALSE(is_better(result_of(66, 60, 32, 31), result_of(66, 700, 300, 280)));
}

TEST(ResultChoice, OneOfMoreImagesIsBetter) {
  EXPECT_TRUE(is_better(result_of(60, 300, 200, 190), result_of(40, 200, 200, 190)));
  EXPECT_FALSE(is_better(result_of(60, 300, 200, 190), result_of(60, 300, 200, 190)))
      << "the earlier one stays";
}

TEST(UnregisteredFrames, AreAllThatAreRegisteredNowhere) {
  EXPECT_EQ(frames_without_pose({1, 3}, 5), (std::set<std::int64_t>{0, 2, 4}));
  EXPECT_TRUE(frames_without_pose({0, 1}, 2).empty());
}

TEST(UnregisteredFrames, AllAreTakenWhereTheyAreFew) {
  EXPECT_EQ(nearest_to_registered({0, 9}, {5}, 2), (std::set<std::int64_t>{0, 9}));
  EXPECT_EQ(nearest_to_registered({0, 9}, {}, 2), (std::set<std::int64_t>{0, 9}));
}

// A map that begins in the middle grows backwards as well, and images before it do not delay a gap in it.
TEST(UnregisteredFrames, ThoseNearestToAPoseOnEitherSideAreTakenFirst) {
  const std::set<std::int64_t> registered = {10, 11, 12, 16, 17};
  EXPECT_EQ(nearest_to_registered(frames_without_pose(registered, 20), registered, 4),
            (std::set<std::int64_t>{9, 13, 15, 18}));
  EXPECT_EQ(nearest_to_registered(frames_without_pose(registered, 20), registered, 6),
            (std::set<std::int64_t>{8, 9, 13, 14, 15, 18}));
}

FinishedMap map_of(std::initializer_list<std::int64_t> frames, std::int64_t first_keyframe) {
  FinishedMap map;
  for (const std::int64_t frame : frames) map.trajectory.push_back({frame, 1000 * frame, Rigid3()});
  const ImageFeaturesPtr image = make_image_features({}, cv::Mat::zeros(480, 640, CV_8UC1), plain_camera());
  map.map.add_keyframe(first_keyframe, 0, Rigid3(), image);
  return map;
}

TEST(FinishedMaps, AMapWhoseFramesAreAllInTheFirstTellsNothingMore) {
  std::vector<FinishedMap> maps;
  maps.push_back(map_of({0, 1, 2, 3, 4, 5}, 0));
  maps.push_back(map_of({2, 3, 7}, 2));
  maps.push_back(map_of({4, 5}, 4));
  exclude_covered_maps(&maps);
  ASSERT_EQ(maps.size(), 2u);
  EXPECT_EQ(maps[1].trajectory.size(), 3u);
}

TEST(FinishedMaps, WhatWasLoadedStays) {
  std::vector<FinishedMap> maps;
  maps.push_back(map_of({0, 1, 2}, 0));
  maps.push_back(map_of({1}, -5));
  exclude_covered_maps(&maps);
  EXPECT_EQ(maps.size(), 2u);
  std::vector<FinishedMap> none;
  exclude_covered_maps(&none);
  EXPECT_TRUE(none.empty());
}

std::vector<RegisteredFrame> registered(const std::vector<std::int64_t>& frames) {
  std::vector<RegisteredFrame> trajectory;
  for (const std::int64_t frame : frames) {
    trajectory.emplace_back();
    trajectory.back().index = frame;
  }
  return trajectory;
}

TEST(DoubtfulFrames, BetweenTwoThatAreBeyondDoubtOneIsNone) {
  EXPECT_TRUE(doubtful_alone(registered({0, 1, 2}), {1}).empty());
  EXPECT_EQ(doubtful_alone(registered({0, 1, 2}), {2}), std::vector<std::int64_t>{2});
  EXPECT_EQ(doubtful_alone(registered({0, 1, 2, 3}), {1, 2}), (std::vector<std::int64_t>{1, 2}));
  EXPECT_TRUE(doubtful_alone(registered({0, 2}), {1}).empty()) << "it has no pose";
}

// The finding, the overview page and report.json name the same images.
TEST(DoubtfulFrames, AreTheSameForEverybody) {
  std::vector<std::int64_t> frames(60);
  std::iota(frames.begin(), frames.end(), 0);
  frames.push_back(80);
  RecordingResult result;
  result.maps.resize(2);
  result.maps[0].trajectory = registered(frames);
  result.maps[1].trajectory = registered({78, 79, 80, 81});
  result.doubtful = {10, 59, 70, 80};
  result.frames_total = 82;
  add_findings(&result);
  EXPECT_EQ(result.maps[0].doubtful, (std::set<std::int64_t>{10, 59, 80}));
  EXPECT_EQ(result.maps[1].doubtful, (std::set<std::int64_t>{80}));
  EXPECT_EQ(doubtful_frames(result), (std::set<std::int64_t>{10, 59, 70, 80}));
  const std::vector<Finding>& findings = result.maps[0].quality.findings();
  ASSERT_GE(findings.size(), 2u);
  EXPECT_EQ(findings[0].kind, FindingKind::kUncertainImages);
  EXPECT_EQ(findings[0].images, (std::vector<std::int64_t>{59, 80}));
  EXPECT_FALSE(findings[0].is_disqualifying);
  ASSERT_EQ(findings[1].kind, FindingKind::kSeveralMaps);
  EXPECT_EQ(findings[1].k, 3) << "78, 79 and 81 are not in the first map";
}

// One of six may distort half of the path; a few of a hundred hardly matter.
TEST(DoubtfulFrames, OnADoubtfulFrameAShortPathMayBeDistorted) {
  EXPECT_FALSE(may_distort_path(0, 6));
  EXPECT_TRUE(may_distort_path(1, 40));
  EXPECT_FALSE(may_distort_path(1, 50));
  EXPECT_FALSE(may_distort_path(11, 100));
  EXPECT_TRUE(may_distort_path(12, 100));
  EXPECT_FALSE(may_distort_path(100, 1000));
  EXPECT_TRUE(may_distort_path(300, 1000)) << "each leads to the next";
}

}  // namespace
}  // namespace mono_pose_tracker
