#include "tracking/result_choice.h"

#include <gtest/gtest.h>

#include <utility>

namespace mono_pose_tracker {
namespace {

constexpr int kImages = 100;

// Of a recording of kImages; nothing speaks against it.
RecordingResult sure(int posed) {
  RecordingResult result;
  result.tracked = true;
  result.rigidity.is_rigid = true;
  result.frames_total = result.frames_with_features = kImages;
  FinishedMap map;
  map.depth_evidence = kMinDepthEvidence;
  map.geometry_evidence = kMinGeometryEvidence;
  map.seam.points = Seam::kMinPoints;
  map.is_founded = true;
  map.trajectory.resize(posed);
  result.trajectory = map.trajectory;
  result.maps.push_back(std::move(map));
  return result;
}

RecordingResult in_doubt(int posed) {
  RecordingResult result = sure(posed);
  result.maps[0].is_founded = false;
  result.maps[0].is_of_smaller_body = true;
  return result;
}

// Of as many matches, that many obey the map.
void explains(long obeying, RecordingResult* result) {
  result->maps[0].other_body.matches = 1000;
  result->maps[0].other_body.obeying = obeying;
}

void hang_loosely(RecordingResult* result) { result->maps[0].seam.points = Seam::kMinPoints - 1; }

bool is_better_of_all(const RecordingResult& result, const RecordingResult& before) {
  return is_better(result, false, before);
}

TEST(ResultChoice, AnythingIsBetterThanNothing) {
  EXPECT_TRUE(is_better_of_all(in_doubt(3), RecordingResult()));
  EXPECT_FALSE(is_better_of_all(RecordingResult(), RecordingResult()));
  EXPECT_FALSE(is_better_of_all(RecordingResult(), in_doubt(3)));
  EXPECT_FALSE(is_better_of_all(RecordingResult(), sure(20)));
}

TEST(ResultChoice, WhatIsSureIsEnoughButInPiecesOrLoose) {
  EXPECT_TRUE(is_enough(sure(kImages), false));
  EXPECT_TRUE(is_enough(sure(kImages / 2), false));
  EXPECT_FALSE(is_enough(sure(kImages / 2 - 1), false)) << "a piece of it";
  EXPECT_FALSE(is_enough(in_doubt(kImages), false));
  RecordingResult loose = sure(kImages);
  hang_loosely(&loose);
  EXPECT_FALSE(is_enough(loose, false));
  EXPECT_TRUE(is_enough(loose, true)) << "by masks of what moves it is not asked for more";
  loose.frames_total = loose.frames_with_features = 1000;
  loose.maps[0].trajectory.resize(1000);
  EXPECT_TRUE(is_enough(loose, false)) << "a long recording is not tracked again for it";
}

TEST(ResultChoice, ASurePieceGivesWayToMostOfTheImages) {
  EXPECT_TRUE(is_better_of_all(in_doubt(66), sure(49)));
  EXPECT_FALSE(is_better_of_all(sure(49), in_doubt(66))) << "whichever came first";
  EXPECT_FALSE(is_better_of_all(in_doubt(52), sure(49))) << "not for three images more";
  EXPECT_FALSE(is_better_of_all(in_doubt(49), sure(30))) << "a piece itself";
  EXPECT_FALSE(is_better_of_all(in_doubt(90), sure(51))) << "not a piece";
  RecordingResult torn = in_doubt(66);
  torn.rigidity.is_rigid = false;
  EXPECT_FALSE(is_better_of_all(torn, sure(49)));
}

TEST(ResultChoice, BlackImagesMakeNoPieces) {
  RecordingResult half = sure(49);
  half.frames_with_features = 60;
  EXPECT_FALSE(is_better_of_all(in_doubt(66), half));
  EXPECT_TRUE(is_enough(half, false));
}

TEST(ResultChoice, OneThatIsFoundedTakesThePlaceOfOneInDoubt) {
  EXPECT_TRUE(is_better_of_all(sure(75), in_doubt(100)));
  EXPECT_FALSE(is_better_of_all(sure(74), in_doubt(100))) << "not of most of the images";
}

TEST(ResultChoice, ASecondBodyIsNoBetterWithFewerImages) {
  RecordingResult of_two = sure(90);
  of_two.maps[0].may_be_of_wrong_body = true;
  EXPECT_FALSE(is_better_of_all(of_two, in_doubt(100)));
  EXPECT_TRUE(is_better_of_all(of_two, in_doubt(90)));
  RecordingResult before = in_doubt(100);
  before.maps[0].may_be_of_wrong_body = true;
  EXPECT_TRUE(is_better_of_all(of_two, before)) << "there were two before";
}

TEST(ResultChoice, OfTwoSureOnesTheOneThatHoldsMore) {
  EXPECT_TRUE(is_better_of_all(sure(91), sure(90)));
  EXPECT_FALSE(is_better_of_all(sure(90), sure(90)));
  EXPECT_FALSE(is_better_of_all(sure(89), sure(90)));
  RecordingResult loose = sure(90);
  hang_loosely(&loose);
  EXPECT_TRUE(is_better_of_all(sure(90), loose));
}

TEST(ResultChoice, AFewImagesMoreAreNoGainWherePlainlyLessIsExplained) {
  RecordingResult more = sure(91), before = sure(90);
  explains(850, &more);
  explains(880, &before);
  EXPECT_TRUE(is_better_of_all(more, before)) << "within what chance does";
  explains(950, &before);
  EXPECT_FALSE(is_better_of_all(more, before));
}

TEST(ResultChoice, OfTwoInDoubtTheOneThatLessSpeaksAgainst) {
  RecordingResult worse = in_doubt(100);
  worse.maps[0].is_of_other_body = true;
  EXPECT_TRUE(is_better_of_all(in_doubt(100), worse));
  EXPECT_FALSE(is_better_of_all(worse, in_doubt(100)));
  EXPECT_FALSE(is_better_of_all(in_doubt(99), worse)) << "of fewer images";
}

TEST(ResultChoice, WhereAsMuchSpeaksAgainstBothDepthsDecideAndThenWhatIsExplained) {
  RecordingResult flat = in_doubt(100), flatter = in_doubt(100);
  flat.maps[0].depth_evidence = 0.5 * kMinDepthEvidence;
  flatter.maps[0].depth_evidence = 0.4 * kMinDepthEvidence;
  EXPECT_TRUE(is_better_of_all(flat, flatter));
  EXPECT_FALSE(is_better_of_all(flatter, flat));
  RecordingResult more = in_doubt(100), less = in_doubt(100);
  explains(900, &more);
  explains(800, &less);
  EXPECT_TRUE(is_better_of_all(more, less));
  EXPECT_FALSE(is_better_of_all(less, more));
}

TEST(ResultChoice, ByMasksMostOfTheImagesAreBetterThanAllWithTheBackground) {
  RecordingResult with_background = sure(100), by_masks = in_doubt(80);
  with_background.maps[0].shows_background = true;
  EXPECT_TRUE(is_better(by_masks, true, with_background));
  EXPECT_FALSE(is_better(by_masks, false, with_background));
  EXPECT_FALSE(is_better(in_doubt(70), true, with_background));
}

}  // namespace
}  // namespace mono_pose_tracker
