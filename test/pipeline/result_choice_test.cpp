#include "pipeline/result_choice.h"

#include <gtest/gtest.h>

#include "mono_pose_tracker/tracking/frame_report.h"
#include "pipeline/recording.h"

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

}  // namespace
}  // namespace mono_pose_tracker
