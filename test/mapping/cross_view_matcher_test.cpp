#include "mapping/cross_view_matcher.h"

#include <gtest/gtest.h>

#include <set>

#include "known_scene.h"
#include "mapping/mapper.h"
#include "mono_pose_tracker/tracking/tracker_options.h"
#include "optimization/map_adjustment.h"
#include "support/mapper_tests.h"

namespace mono_pose_tracker {
namespace {

constexpr int kViewsOfVisit = 3;  // views of each visit

class CrossViewMatcherTest : public testing::Test {
 protected:
  // Keyframes of one visit to the place with landmarks of their own, all displaced by the drift.
  void visit(int first_index, const Eigen::Vector3d& drift) {
    std::vector<KeyframeId> ids;
    for (int v = 0; v < kViewsOfVisit; ++v) {
      const Frame frame = scene_.frame(first_index + v, KnownScene::pose(v));
      const Rigid3 drift_from_map{Eigen::Quaterniond::Identity(), drift};
      ids.push_back(map_.add_keyframe(frame.index, frame.stamp_ns,
                                      KnownScene::pose(v) * drift_from_map.inverse(), frame.image));
    }
    for (std::size_t p = 0; p < scene_.scene.x_in_map.size(); ++p) {
      const LandmarkId l = map_.add_landmark(scene_.scene.x_in_map[p] + drift);
      int seen = 0;
      for (int v = 0; v < kViewsOfVisit; ++v) {
        const int feature = scene_.feature_of(first_index + v, static_cast<int>(p));
        if (feature >= 0) seen += map_.add_observation(l, ids[v], feature);
      }
      if (seen < 2) map_.remove_landmark(l);
    }
  }

  MapperOptions options() const { return TrackerOptions().mapper(scene_.camera.focal()); }
  std::vector<SharedTrack> match_across_views_of(Map* map, KeyframeId newer_than = -1) {
    ViewGraph graph(view_graph_options(options()));
    return match_across_views(options(), overlapping_pairs(BundleOptions(), *map, newer_than), &graph, map);
  }
  std::size_t link() { return match_across_views_of(&map_).size(); }

  static int landmarks_observed_by(const Map& map, KeyframeId id) {
    const std::vector<LandmarkId>& landmarks = map.keyframe(id)->landmark_of_feature;
    return static_cast<int>(
        std::count_if(landmarks.begin(), landmarks.end(), [](LandmarkId l) { return l != kNoLandmark; }));
  }

  // Whether a keyframe of the first visit shares landmarks with one of the second.
  bool is_matched() const { return is_matched(map_); }
  static bool is_matched(const Map& map) {
    for (const auto& entry : map.covisible(0)) {
      if (entry.first >= kViewsOfVisit) return true;
    }
    return false;
  }

  KnownScene scene_{250};
  Map map_;
};

TEST_F(CrossViewMatcherTest, MatchesTwoVisitsOfOnePlace) {
  visit(0, Eigen::Vector3d::Zero());
  visit(100, {0.1, 0.05, -0.1});
  ASSERT_FALSE(is_matched());
  const std::size_t before = map_.landmarks().size();
  EXPECT_GT(link(), 0);
  map_.check();
  EXPECT_TRUE(is_matched());
  EXPECT_LT(map_.landmarks().size(), 0.6 * before) << "two landmarks of one point are one now";
  int wrong = 0;
  for (const auto& entry : map_.landmarks()) wrong += scene_.point_of_landmark(map_, entry.second) < 0;
  EXPECT_EQ(wrong, 0);
}

TEST_F(CrossViewMatcherTest, PosesAreLeftToTheBundleAdjustment) {
  visit(0, Eigen::Vector3d::Zero());
  visit(100, {0.1, 0.05, -0.1});
  const std::map<KeyframeId, Keyframe> before = map_.keyframes();
  ASSERT_GT(link(), 0);
  for (const auto& [id, keyframe] : map_.keyframes()) {
    EXPECT_EQ(keyframe.camera_from_map.translation, before.at(id).camera_from_map.translation);
  }
}

TEST_F(CrossViewMatcherTest, SharedTracksAreNotMatchedAgain) {
  visit(0, Eigen::Vector3d::Zero());
  EXPECT_EQ(link(), 0);
}

TEST_F(CrossViewMatcherTest, AnotherPlaceInTheSameDirectionIsNotMatched) {
  visit(0, Eigen::Vector3d::Zero());
  for (int i = 0; i < scene_.scene.descriptors.rows; ++i) {
    for (int k = 0; k < 128; ++k) {
      scene_.scene.descriptors.at<std::uint8_t>(i, k) = static_cast<std::uint8_t>(scene_.random.index(80));
    }
  }
  visit(100, {0.1, 0.05, -0.1});
  EXPECT_EQ(link(), 0);
  EXPECT_FALSE(is_matched());
}

TEST_F(CrossViewMatcherTest, OnlyPairsOfWhichOneIsNewerAreLookedAt) {
  visit(0, Eigen::Vector3d::Zero());
  visit(100, {0.1, 0.05, -0.1});
  EXPECT_TRUE(match_across_views_of(&map_, map_.keyframes().rbegin()->first).empty());
  EXPECT_FALSE(is_matched());
  EXPECT_FALSE(match_across_views_of(&map_, kViewsOfVisit - 1).empty());
  EXPECT_TRUE(is_matched());
}

TEST_F(CrossViewMatcherTest, NothingIsMatchedOnceItIsCancelled) {
  visit(0, Eigen::Vector3d::Zero());
  visit(100, {0.1, 0.05, -0.1});
  MapperOptions cancelled = options();
  cancelled.bundle.cancel = [] { return true; };
  ViewGraph graph(view_graph_options(cancelled));
  EXPECT_TRUE(overlapping_pairs(cancelled.bundle, map_).empty());
  EXPECT_TRUE(match_across_views(cancelled, overlapping_pairs(BundleOptions(), map_), &graph, &map_).empty());
  EXPECT_TRUE(graph.edges().empty());
  EXPECT_FALSE(is_matched());
}

TEST_F(CrossViewMatcherTest, SharedTracksHoldInAMapThatChangedMeanwhile) {
  visit(0, Eigen::Vector3d::Zero());
  visit(100, {0.1, 0.05, -0.1});
  Map snapshot = map_;
  const std::vector<SharedTrack> tracks = match_across_views_of(&snapshot);
  ASSERT_FALSE(tracks.empty());
  Map without = map_;
  for (const SharedTrack& track : tracks) without.remove_keyframe(track.keyframe, 0);
  merge_tracks(tracks, &without);
  without.check();
  EXPECT_FALSE(is_matched(without));
  map_.remove_landmark(tracks.front().landmark);
  merge_tracks(tracks, &map_);
  map_.check();
  EXPECT_TRUE(is_matched());
}

TEST_F(CrossViewMatcherTest, InconsistentSharedTracksAreReported) {
  visit(0, Eigen::Vector3d::Zero());
  visit(100, {0.1, 0.05, -0.1});
  const std::vector<SharedTrack> tracks = match_across_views_of(&map_);
  ASSERT_FALSE(tracks.empty());
  constexpr double kMaxErrorPx = 3;
  std::set<KeyframeId> matched_keyframes;
  for (const SharedTrack& track : tracks) matched_keyframes.insert(track.keyframe);
  EXPECT_EQ(with_inconsistent_tracks(tracks, map_, kMaxErrorPx), matched_keyframes)
      << "0.1 off at a few times that";
  adjust_map(with_wide_loss(BundleOptions()), &map_);
  adjust_map(BundleOptions(), &map_);
  EXPECT_TRUE(with_inconsistent_tracks(tracks, map_, kMaxErrorPx).empty());
}

// A map that returned to a place is corrected before the end of the recording.
TEST_F(CrossViewMatcherTest, AMapperMatchesThemInTheBackgroundWhenItAdjustsAll) {
  visit(0, Eigen::Vector3d::Zero());
  visit(100, {0.02, 0.01, -0.02});
  MapperOptions narrow = options();
  narrow.mapping.window_keyframes = 2;
  Mapper mapper(narrow);
  mapper.restore(map_, 0);
  ASSERT_FALSE(is_matched(mapper.map()));
  mapper.adjust_now_and_then();
  const BackgroundJob aside = mapper.take_background_job();
  ASSERT_TRUE(aside);
  const auto rest = aside([] { return false; });
  // Meanwhile the map grows and its window is adjusted, which moves all landmarks there.
  const Frame frame = scene_.frame(100 + kViewsOfVisit, KnownScene::pose(kViewsOfVisit));
  mapper.insert(registered_candidate(TrackerOptions(), scene_.camera, *mapper.tracking_map(), frame));
  const int seen_before = landmarks_observed_by(mapper.map(), kViewsOfVisit);
  rest(mapper);
  mapper.map().check();
  EXPECT_TRUE(is_matched(mapper.map()));
  EXPECT_GT(landmarks_observed_by(mapper.map(), kViewsOfVisit), 0.9 * seen_before);
  ASSERT_EQ(mapper.tracking_map()->corrections.size(), 1u);
  const auto& scale_of = mapper.tracking_map()->corrections[0]->scale_of;
  for (const auto& [id, scale] : scale_of) {
    EXPECT_NEAR(scale / scale_of.begin()->second, 1, 0.003) << id << ": a visit is as long as the other";
  }
  // Both visits had the same path.
  const auto way = [&](KeyframeId id) -> Eigen::Vector3d {
    return mapper.map().keyframe(id + kViewsOfVisit)->center_in_map() -
           mapper.map().keyframe(id)->center_in_map();
  };
  EXPECT_LT(way(0).norm(), 0.3 * Eigen::Vector3d(0.02, 0.01, -0.02).norm());
}

}  // namespace
}  // namespace mono_pose_tracker
