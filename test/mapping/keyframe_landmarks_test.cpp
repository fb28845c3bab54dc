#include "mapping/keyframe_landmarks.h"

#include <gtest/gtest.h>

#include "known_scene.h"

namespace mono_pose_tracker {
namespace {

// Each of the two keyframes observes both landmarks.
Map map_with_ids(LandmarkId first, LandmarkId second) {
  KnownScene scene(60);
  std::vector<Keyframe> keyframes(2);
  std::vector<Landmark> landmarks(2);
  for (int k = 0; k < 2; ++k) {
    keyframes[k].id = k;
    keyframes[k].frame_index = k;
    keyframes[k].image = scene.frame(k).image;
  }
  landmarks[0].id = first;
  landmarks[1].id = second;
  for (int l = 0; l < 2; ++l) landmarks[l].observations = {{0, l}, {1, l}};
  return Map::restore(keyframes, landmarks, {}, ScaleSource::kMapUnits);
}

TEST(KeyframeLandmarks, AreInTheOrderOfTheirIdsHoweverFarApart) {
  for (const LandmarkId second : {LandmarkId{8}, LandmarkId{1000000000}}) {
    EXPECT_EQ(landmarks_observed_by(map_with_ids(3, second), {0, 1}), (std::vector<LandmarkId>{3, second}));
  }
}

}  // namespace
}  // namespace mono_pose_tracker
