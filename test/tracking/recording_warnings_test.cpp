#include "tracking/recording_warnings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <numeric>
#include <string>

namespace mono_pose_tracker {
namespace {

// What is said of doubtful poses, when these images are posed in the only map, or in the last of so many, and
// these are doubtful; empty: nothing.
std::string doubt_of(const std::vector<std::int64_t>& posed, const std::set<std::int64_t>& doubtful,
                     int maps = 1) {
  RecordingResult result;
  result.maps.resize(maps);
  for (const std::int64_t index : posed) result.maps.back().trajectory.push_back({index, index, Rigid3()});
  result.doubtful = doubtful;
  warn_of_doubts(&result);
  for (const std::string& warning : result.warnings) {
    if (warning.find("doubtful") != std::string::npos) return warning;
  }
  return "";
}

TEST(RecordingWarnings, ADoubtfulPoseBetweenTwoSureOnesIsNotTold) {
  EXPECT_EQ(doubt_of({0, 1, 2, 3, 4}, {2}), "");
  EXPECT_EQ(doubt_of({0, 1, 2, 3}, {4}), "") << "has no pose any more";
}

TEST(RecordingWarnings, DoubtfulPosesAtAnEndAreTold) {
  EXPECT_NE(doubt_of({0, 1, 2, 3, 4}, {3, 4}).find("2 images are doubtful (number 3, 4)"), std::string::npos);
  EXPECT_NE(doubt_of({0, 1, 2, 4, 5}, {2}).find("1 images are doubtful (number 2)"), std::string::npos);
}

TEST(RecordingWarnings, OfASmallerMapDoubtfulPosesAreToldWhereTheyMayTakeItOff) {
  std::vector<std::int64_t> many(60);
  std::iota(many.begin(), many.end(), 0);
  EXPECT_NE(doubt_of({0, 1, 2, 3, 4}, {3, 4}, 2).find("2 images of map_2 are doubtful"), std::string::npos);
  EXPECT_EQ(doubt_of(many, {59}, 2), "");
}

bool is_told(const RecordingResult& result, const std::string& words) {
  return std::any_of(result.warnings.begin(), result.warnings.end(),
                     [&](const std::string& line) { return line.find(words) != std::string::npos; });
}

TEST(RecordingWarnings, ALooseEndIsTold) {
  RecordingResult result;
  result.maps.resize(1);
  result.left_out = {7, 8, 9};
  warn_of_doubts(&result);
  EXPECT_TRUE(is_told(result, "3 images between number 7 and 9"));
}

TEST(RecordingWarnings, AnUnknownPathIsToldByWhatItExceeds) {
  RecordingResult result;
  result.maps.resize(1);
  result.maps[0].path = {0.03, 1, 0.5};
  warn_of_doubts(&result);
  EXPECT_TRUE(is_told(result, "open by 3.0 % of its length"));
  result.warnings.clear();
  result.maps[0].path = {0.004, 1, 0.01};  // to and fro about one place
  warn_of_doubts(&result);
  EXPECT_TRUE(is_told(result, "open by 40 % of how far the camera came about"));
  result.warnings.clear();
  result.maps[0].path = {0.004, 1, 0.5};
  warn_of_doubts(&result);
  EXPECT_FALSE(is_told(result, "leave the path"));
}

// A map that nothing speaks against.
FinishedMap sure_map() {
  FinishedMap map;
  map.depth_evidence = map.geometry_evidence = 1e3;
  map.seam.points = 1000;
  return map;
}

struct Objection {
  std::string words;  // of its warning
  std::function<void(FinishedMap*)> make;
};

const Objection kObjections[] = {
    {"30 of 90 points are seen elsewhere",
     [](FinishedMap* map) {
       map->contradiction = {12, 90, 30};
     }},
    {"30 of 90 points of what is seen",
     [](FinishedMap* map) {
       map->misplaced = {12, 40, 90, 30};
     }},
    {"30 of 90 points have two places",
     [](FinishedMap* map) {
       map->torn_tracks = {12, 90, 30, 0.01};
     }},
    {"20 of 100 points stay in their place",
     [](FinishedMap* map) {
       map->still = {100, 20};
     }},
    {"30 of 90 points lie at the lens",
     [](FinishedMap* map) {
       map->collapse = {12, 90, 30};
     }},
    {"jumps to and fro, 9 times",
     [](FinishedMap* map) {
       map->restless = {12, 9};
     }},
    {"not plainly the one that turns", [](FinishedMap* map) { map->is_of_other_body = true; }},
    {"two bodies move, each as one, or the map is wrong",
     [](FinishedMap* map) {
       map->other_body.pairs = map->other_body.other_pairs = 10;
       map->other_body.tracks.resize(10);
       for (BodyTrack& track : map->other_body.tracks) track.is_other = true;
       map->is_of_smaller_body = true;
     }},
    {"before a background that stands still", [](FinishedMap* map) { map->shows_background = true; }},
    {"another path before another plane", [](FinishedMap* map) { map->geometry_evidence = 0; }},
    {"the depths could as well be reversed", [](FinishedMap* map) { map->depth_evidence = 0; }},
};

// What speaks against a map keeps it from being sure, and is said to the user, each in a line of its own.
TEST(RecordingWarnings, EachObjectionToAMapIsTold) {
  RecordingResult sure;
  sure.maps = {sure_map()};
  ASSERT_TRUE(sure.maps[0].is_sure());
  warn_of_doubts(&sure);
  EXPECT_TRUE(sure.warnings.empty()) << sure.warnings.front();

  for (const Objection& objection : kObjections) {
    RecordingResult result;
    result.maps = {sure_map()};
    objection.make(&result.maps[0]);
    EXPECT_FALSE(result.maps[0].is_sure()) << objection.words;
    warn_of_doubts(&result);
    ASSERT_EQ(result.warnings.size(), 1u) << objection.words;
    EXPECT_TRUE(is_told(result, objection.words)) << result.warnings.front();
  }
}

TEST(RecordingWarnings, AMapOfFewOfTheImagesIsTold) {
  RecordingResult result;
  result.maps = {sure_map()};
  result.maps[0].trajectory.resize(19);
  result.frames_total = 30;
  warn_of_doubts(&result);
  EXPECT_FALSE(is_told(result, "images only"));
  result.maps[0].holds_little = true;
  warn_of_doubts(&result);
  EXPECT_TRUE(is_told(result, "19 of 30 images only"));
}

TEST(RecordingWarnings, MoreThanOneMotionIsTold) {
  RecordingResult result;
  result.maps = {sure_map()};
  result.rigidity.is_rigid = false;
  result.rigidity.parts = "left and right";
  warn_of_doubts(&result);
  ASSERT_EQ(result.warnings.size(), 1u);
  EXPECT_TRUE(is_told(result, "left and right")) << result.warnings.front();
}

TEST(RecordingWarnings, ALineNamesTenAtMost) {
  std::vector<std::int64_t> posed;
  std::set<std::int64_t> doubtful;
  for (int i = 0; i < 40; ++i) {
    posed.push_back(i);
    if (i >= 20) doubtful.insert(i);
  }
  const std::string line = doubt_of(posed, doubtful);
  EXPECT_NE(line.find("20 images"), std::string::npos) << line;
  EXPECT_NE(line.find(", 29, ...)"), std::string::npos) << line;
}

}  // namespace
}  // namespace mono_pose_tracker
