#include "mapping/motion_segmentation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <vector>

#include "mapping/view_graph.h"
#include "support/synthetic_views.h"
#include "support/two_objects.h"

namespace mono_pose_tracker {
namespace {

class IndependentMotionTest : public testing::Test, protected TwoObjects {
 protected:
  MotionSegmentationOptions options() const {
    MotionSegmentationOptions options;
    options.ransac = ransac();
    return options;
  }
  IndependentMotion find(const Map& map) const {
    return find_independent_motion(map, {}, ComparedImages::kKeyframes, options());
  }
};

TEST_F(IndependentMotionTest, AHeadBeforeAMapOfTheRoomTurnsMore) {
  const IndependentMotion motion = find(map_with(false, 60, 300));
  ASSERT_TRUE(motion.exists());
  EXPECT_FALSE(motion.rotates_plainly_less());
  EXPECT_GT(motion.other_rotation, 3 * motion.map_rotation);
  EXPECT_FALSE(motion.is_comparable()) << "one point in six";
}

TEST_F(IndependentMotionTest, TheRoomBehindAMapOfTheHeadTurnsLess) {
  const IndependentMotion motion = find(map_with(true, 150, 200));
  ASSERT_TRUE(motion.exists());
  EXPECT_TRUE(motion.rotates_plainly_less());
  EXPECT_TRUE(motion.is_comparable());
}

TEST_F(IndependentMotionTest, OneObjectHasNoOther) { EXPECT_FALSE(find(map_with(true, 200, 0)).exists()); }

TEST(MotionEvidence, ExistsWhereAFourthOfThePairsShowsIt) {
  MotionEvidence evidence;
  EXPECT_FALSE(evidence.exists());
  evidence.pairs = 4, evidence.other_pairs = 1;
  EXPECT_TRUE(evidence.exists());
  evidence += {1};
  EXPECT_FALSE(evidence.exists());
  EXPECT_EQ(evidence.pairs, 5);
}

// An object in a fourth of the pairs is not the larger one, however many matches it has there.
TEST(MotionEvidence, AnObjectMustBeInViewToBeLarger) {
  MotionEvidence alone{1, 0, 100}, both{1, 1, 40, 160};
  MotionEvidence all = both;
  for (int pair = 0; pair < 3; ++pair) all += alone;
  EXPECT_NEAR(all.share(), 160.0 / 500, 1e-9);
  EXPECT_TRUE(all.is_comparable());
  EXPECT_FALSE(all.is_larger());
  EXPECT_TRUE(both.is_larger());
}

TEST_F(IndependentMotionTest, ASampleTellsItAsWell) {
  const MotionEvidence sample = sample_independent_motion(map_with(true, 150, 200), {1}, options());
  EXPECT_EQ(sample.pairs, kKeyframes - 1);
  EXPECT_TRUE(sample.is_comparable());
  EXPECT_FALSE(sample_independent_motion(map_with(true, 200, 0), {1}, options()).is_comparable());
  EXPECT_FALSE(sample_independent_motion(Map(), {1, 2, 4}, options()).exists());
}

TEST_F(IndependentMotionTest, ASampleShowsThatASmallObjectRotatesMore) {
  const MotionEvidence sample = sample_independent_motion(map_with(false, 60, 300), {1, 2, 4}, options());
  EXPECT_EQ(sample.pairs, (kKeyframes - 1) + (kKeyframes - 2) + (kKeyframes - 4));
  EXPECT_TRUE(sample.exists());
  EXPECT_FALSE(sample.is_comparable());
  EXPECT_TRUE(sample.rotates_plainly_more());
}

TEST_F(IndependentMotionTest, MatchesOfTheViewGraphAreUsed) {
  const Map map = map_with(true, 150, 200);
  const std::atomic<bool> is_set{true};
  const auto of_map = [&](CancelFlag matches_none, bool is_reversed) {
    ViewGraphOptions graph_options;
    graph_options.ransac = ransac();
    graph_options.matching.cancelled = matches_none;
    ViewGraph graph(graph_options);
    std::vector<RegisteredImage> images;
    for (const auto& entry : map.keyframes()) images.push_back(registered_image(entry.second));
    if (is_reversed) std::reverse(images.begin(), images.end());
    std::vector<ViewGraph::Pair> pairs;
    for (const RegisteredImage& image : images) {
      const int node = graph.add(image.frame_index, image.image);
      for (const int apart : {1, 2, 4}) {
        if (node >= apart) pairs.emplace_back(node - apart, node);
      }
    }
    graph.connect(pairs);
    return sample_independent_motion(map, {1, 2, 4}, options(), &graph).of_map;
  };
  const long without = sample_independent_motion(map, {1, 2, 4}, options()).of_map;
  for (const bool is_reversed : {false, true}) {
    EXPECT_EQ(of_map(nullptr, is_reversed), without) << is_reversed;
    EXPECT_EQ(of_map(&is_set, is_reversed), 0) << "of a graph without matches, " << is_reversed;
  }
}

TEST_F(IndependentMotionTest, TracksTellWhichFeaturesAreWhose) {
  const Map map = map_with(false, 100, 300);
  const IndependentMotion motion = find(map);
  int right = 0, wrong = 0, of_head = 0;
  for (const MotionTrack& track : motion.tracks) {
    const auto& features = map.keyframe(static_cast<KeyframeId>(track.from_index))->image->set.features;
    int f = 0;
    while (features[f].pixel != track.from) ++f;
    const bool is_head = f < head_features(static_cast<int>(track.from_index));
    of_head += is_head;
    (is_head == track.is_other ? right : wrong) += 1;
  }
  EXPECT_GT(of_head, 400);
  EXPECT_LT(wrong, 0.05 * right);
}

TEST_F(IndependentMotionTest, ImagesBetweenTheKeyframesAreInTheTracks) {
  const Map map = map_with(false, 100, 300);
  Map sparse;
  std::vector<RegisteredImage> between;
  for (const auto& [id, k] : map.keyframes()) {
    if (id % 2 == 0) sparse.add_keyframe(k.frame_index, k.stamp_ns, k.camera_from_map, k.image);
    if (id % 2 != 0) between.push_back({k.frame_index, k.camera_from_map, k.image});
  }
  const IndependentMotion motion =
      find_independent_motion(sparse, between, ComparedImages::kAllSeen, options());
  ASSERT_FALSE(motion.tracks.empty());
  for (const MotionTrack& track : motion.tracks) EXPECT_EQ(track.to_index, track.from_index + 1);
}

// The keyframes of a room's map keep features near its points: the head is excluded.
TEST_F(IndependentMotionTest, FeaturesTheMapExcludedAreSeen) {
  const Map map = map_with(false, 100, 300);
  Map without_head;
  std::vector<RegisteredImage> seen;
  for (const auto& [id, k] : map.keyframes()) {
    std::vector<char> is_room(k.image->size(), 1);
    std::fill_n(is_room.begin(), head_features(static_cast<int>(id)), 0);
    without_head.add_keyframe(k.frame_index, k.stamp_ns, k.camera_from_map,
                              select_features(*k.image, is_room));
    seen.push_back({k.frame_index, k.camera_from_map, k.image});
  }
  EXPECT_FALSE(find(without_head).exists());
  EXPECT_TRUE(find_independent_motion(without_head, seen, ComparedImages::kKeyframes, options()).exists());
}

TEST_F(IndependentMotionTest, TheTurnIsWhatTheCamerasSpan) {
  EXPECT_NEAR(rotation_before_cameras(map_with(true, 200, 0)) / kDegree, 6.0 * (kKeyframes - 1), 3);
  EXPECT_LT(rotation_before_cameras(map_with(false, 50, 200)) / kDegree, 5);
}

}  // namespace
}  // namespace mono_pose_tracker
