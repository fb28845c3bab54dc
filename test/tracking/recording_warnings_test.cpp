#include "tracking/recording_warnings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace mono_pose_tracker {
namespace {

// What is said of doubtful poses, when so many images are posed and these are doubtful; empty: nothing.
std::string doubt_of(const std::vector<std::int64_t>& posed, const std::set<std::int64_t>& doubtful) {
  RecordingResult result;
  for (const std::int64_t index : posed) result.trajectory.push_back({index, index, Rigid3()});
  result.maps.resize(1);
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

TEST(RecordingWarnings, APartThatHasShrunkToAPointIsTold) {
  RecordingResult result;
  result.maps.resize(1);
  result.maps[0].depth_evidence = result.maps[0].geometry_evidence = 1e3;
  ASSERT_TRUE(result.maps[0].is_sure());
  result.maps[0].collapse = {12, 100, 30};
  warn_of_doubts(&result);
  EXPECT_TRUE(is_told(result, "30 of 100 points lie at the lens"));
  EXPECT_FALSE(result.maps[0].is_sure());
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
