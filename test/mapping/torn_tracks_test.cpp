#include "mono_pose_tracker/mapping/torn_tracks.h"

#include <gtest/gtest.h>

#include "support/add_view.h"

namespace mono_pose_tracker {
namespace {

constexpr int kRow = 8, kRowPoints = 200, kTear = 5;

// Keyframes before a box of points. Each landmark is seen by all, but that from kTear on those of `torn` are
// seen as others, and so are from each keyframe on a few more, `usual` of them.
Map make_torn_map(int torn, int usual, int first_frame = 0) {
  Random random(5);
  const CameraModel camera = synthetic_camera();
  const SyntheticScene scene = box_scene(kRowPoints, random);
  Map map;
  std::vector<LandmarkId> ids;
  for (const Eigen::Vector3d& x : scene.x_in_map) ids.push_back(map.add_landmark(x));
  const auto tear = [&](int i) { ids[i] = map.add_landmark(scene.x_in_map[i]); };
  for (int k = 0; k < kRow; ++k) {
    for (int i = 0; k > 0 && i < usual; ++i) tear((17 * k + i) % kRowPoints);
    for (int i = 0; k == kTear && i < torn; ++i) tear((17 * k + usual + i) % kRowPoints);
    const Rigid3 camera_from_map = camera_at({0.03 * k, 0, 0}, 0);
    add_view(scene, camera, camera_from_map, 0.5, first_frame + k, ids, random, &map);
  }
  return map;
}

TornTracks worst_of(const Map& map) { return worst_torn_tracks(map, match_in_time(map, MatchOptions(), 1)); }

TEST(TornTracks, ARightMapHasAFew) {
  const TornTracks worst = worst_of(make_torn_map(0, 5));
  EXPECT_GT(worst.matches, kRowPoints / 2);
  EXPECT_GT(worst.torn, 0);
  EXPECT_FALSE(worst.is_significant());
}

TEST(TornTracks, AreSeenWhereTheyBegin) {
  const TornTracks worst = worst_of(make_torn_map(25, 5));
  EXPECT_EQ(worst.frame_index, kTear);
  EXPECT_GE(worst.torn, 20);
  EXPECT_GT(worst.share(), 2 * worst.usual_share);
  EXPECT_TRUE(worst.is_significant());
}

// Frames of earlier runs come before 0.
TEST(TornTracks, AreSeenInAMapThatWasLoadedAsWell) {
  constexpr int kFirst = -100;
  const TornTracks worst = worst_of(make_torn_map(25, 5, kFirst));
  EXPECT_EQ(worst.frame_index, kFirst + kTear);
  EXPECT_TRUE(worst.is_significant());
}

TEST(TornTracks, OfARepeatedTextureAreEverywhere) {
  const TornTracks worst = worst_of(make_torn_map(0, 30));
  EXPECT_GT(worst.share(), TornTracks::kMostOfARightMap);
  EXPECT_GE(worst.torn, TornTracks::kMinTorn);
  EXPECT_FALSE(worst.is_significant());
}

TEST(TornTracks, ThereIsNothingToCompareInAnEmptyMap) {
  const TornTracks none = worst_of(Map());
  EXPECT_EQ(none.frame_index, -1);
  EXPECT_FALSE(none.is_significant());
}

}  // namespace
}  // namespace mono_pose_tracker
