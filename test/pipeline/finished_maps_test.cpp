#include "pipeline/finished_maps.h"

#include <gtest/gtest.h>

#include <initializer_list>

#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

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
  EXPECT_EQ(frames_outside_first(maps), 1u) << "the seventh";
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
  EXPECT_EQ(frames_outside_first(none), 0u);
}

}  // namespace
}  // namespace mono_pose_tracker
