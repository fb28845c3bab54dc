#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "common/statistics.h"
#include "mapping/mapper.h"
#include "support/mapper_tests.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr double kNoise = 0.3;  // px

// A textured wall along which the camera moves; frame i is at x = 0.2 i.
class MapperJoiningTest : public testing::Test {
 protected:
  static SyntheticScene wall(Random& random) {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 1500; ++i) {
      points.emplace_back(random.uniform(-2, 14), random.uniform(-1.2, 1.2), random.uniform(3, 6));
    }
    return SyntheticScene(points, random);
  }

  // A frame is the same for every caller.
  Frame frame(int i, std::vector<int>* point_of = nullptr) {
    auto [image, is_new] = images_.try_emplace(i);
    auto& [frame, points] = image->second;
    if (is_new) frame = synthetic_frame(scene_, camera_, pose(i), kNoise, i, random_, &points);
    if (point_of) *point_of = points;
    return frame;
  }
  static Rigid3 pose(int i) { return camera_at({0.2 * i, 0, 0}); }

  // Two views and their common points, in the frame of the first view and half as large.
  InitialMap initial_map(int first, int second) {
    InitialMap map;
    std::vector<std::vector<int>> point_of(2);
    const Rigid3 map_from_world = pose(first);
    for (int v = 0; v < 2; ++v) {
      const int i = v == 0 ? first : second;
      Rigid3 camera_from_map = pose(i) * map_from_world.inverse();
      camera_from_map.translation *= 0.5;
      map.views.push_back({frame(i, &point_of[v]), camera_from_map});
    }
    for (std::size_t f = 0; f < point_of[0].size(); ++f) {
      const auto found = std::find(point_of[1].begin(), point_of[1].end(), point_of[0][f]);
      if (found == point_of[1].end()) continue;
      map.points.push_back({0.5 * (map_from_world * scene_.x_in_map[point_of[0][f]]),
                            {{0, static_cast<int>(f)}, {1, static_cast<int>(found - point_of[1].begin())}}});
    }
    return map;
  }

  KeyframeCandidate candidate_of(int i) {
    return registered_candidate(options_, camera_, *mapper_.tracking_map(), frame(i));
  }

  void insert(int i, int waiting = 0) {
    const KeyframeCandidate candidate = candidate_of(i);
    ASSERT_FALSE(HasFailure());
    mapper_.insert(candidate, waiting);
  }

  // Largest error of the distances between all keyframes, relative to the longest, after the unit is aligned.
  double worst_distance_error() {
    std::vector<Eigen::Vector3d> found, truth;
    for (const auto& [id, keyframe] : mapper_.map().keyframes()) {
      found.push_back(keyframe.center_in_map());
      truth.push_back(pose(static_cast<int>(keyframe.frame_index)).inverse().translation);
    }
    const std::vector<double> errors = aligned_errors(found, truth);
    double longest = 0;
    for (const Eigen::Vector3d& center : truth) longest = std::max(longest, (center - truth[0]).norm());
    return *std::max_element(errors.begin(), errors.end()) / longest;
  }

  std::map<int, std::pair<Frame, std::vector<int>>> images_;
  Random random_{23};
  TrackerOptions options_ = unhurried_options();
  CameraModel camera_ = synthetic_camera();
  SyntheticScene scene_ = wall(random_);
  Mapper mapper_{options_.mapper(camera_.focal())};
};

TEST_F(MapperJoiningTest, MapsAreJoinedWhereTheyMeet) {
  mapper_.initialize(initial_map(0, 2), 0);
  for (int i = 4; i <= 10; i += 2) insert(i);
  const TrackingMapPtr old = mapper_.tracking_map();
  mapper_.begin_additional(initial_map(50, 48), 1);
  EXPECT_EQ(mapper_.inactive_maps(), std::vector<std::uint32_t>{old->map_id});
  for (int i = 46; i >= 32; i -= 2) insert(i);
  EXPECT_EQ(mapper_.inactive_maps().size(), 1u) << "nothing is in view that the old map knows";
  EXPECT_NE(mapper_.tracking_map()->map_id, old->map_id);
  int last = 32;
  while (!mapper_.inactive_maps().empty() && last > 8) insert(last -= 2);
  ASSERT_TRUE(mapper_.inactive_maps().empty()) << "they were never joined";
  const TrackingMapPtr joined = mapper_.tracking_map();
  EXPECT_EQ(joined->map_id, old->map_id) << "the older map's frame stays";
  ASSERT_EQ(joined->corrections.size(), 1u);
  EXPECT_EQ(joined->corrections[0]->into_map, old->map_id);
  EXPECT_GT(joined->corrections[0]->added.keyframes, old->keyframes.rbegin()->first);
  mapper_.map().check();
  const Rigid3 before = old->keyframes.begin()->second.camera_from_map;
  const Rigid3 after = joined->keyframes.begin()->second.camera_from_map;
  EXPECT_LT((before.inverse().translation - after.inverse().translation).norm(), 0.01);
  insert(last - 2);  // continues across the boundary
  mapper_.finish();
  mapper_.map().check();
  EXPECT_LT(worst_distance_error(), 0.01);
}

// Only the newer map observed the marker: the merged map keeps metres.
TEST_F(MapperJoiningTest, AMarkerThatOnlyTheNewerMapSawIsKept) {
  MapperOptions metres = options_.mapper(camera_.focal());
  metres.scale.marker_size = 0.5;
  mapper_ = Mapper(metres);
  const auto seen_marker = [&](int i) {
    std::vector<Eigen::Vector3d> bearings;
    for (const auto& [x, y] : {std::pair{0.0, 0.0}, {0.5, 0.0}, {0.5, 0.5}, {0.0, 0.5}})
      bearings.push_back((pose(i) * Eigen::Vector3d(9.5 + x, y, 4)).normalized());
    return bearings;
  };
  mapper_.initialize(initial_map(0, 2), 0);
  for (int i = 4; i <= 10; i += 2) insert(i);
  InitialMap additional = initial_map(50, 48);
  additional.views[0].frame.marker = seen_marker(50);
  additional.views[1].frame.marker = seen_marker(48);
  mapper_.begin_additional(additional, 1);
  ASSERT_EQ(mapper_.map().scale_source(), ScaleSource::kMarker);
  for (int i = 46; !mapper_.inactive_maps().empty() && i > 8; i -= 2) insert(i);
  ASSERT_TRUE(mapper_.inactive_maps().empty()) << "they were never joined";
  EXPECT_EQ(mapper_.map().scale_source(), ScaleSource::kMarker);
  const auto centers = [&](std::int64_t frame) {
    for (const auto& [id, keyframe] : mapper_.map().keyframes())
      if (keyframe.frame_index == frame) return keyframe.center_in_map();
    return Eigen::Vector3d(Eigen::Vector3d::Constant(NAN));
  };
  EXPECT_NEAR((centers(50) - centers(48)).norm(), 0.4, 0.02) << "of the marker's own views";
}

TEST(UnitSource, MisregisteredKeyframesGiveNone) {
  const Map without_them;
  for (const KeyframeId wrong : {4, 7}) {
    UnitSource unit;
    unit.baseline = {4, 7};
    unit.forget({2}, without_them);
    EXPECT_TRUE(unit.baseline) << "culled keyframes have a stored pose";
    unit.forget({wrong}, without_them);
    EXPECT_FALSE(unit.baseline) << wrong;
  }
}

// Each part keeps the covariances of its keyframes, in the unit of the merged map.
TEST_F(MapperJoiningTest, KeyframesKeepTheirCovariances) {
  mapper_.initialize(initial_map(0, 2), 0);
  for (int i = 4; i <= 10; i += 2) insert(i);
  const TrackingMapPtr old = mapper_.tracking_map();
  ASSERT_EQ(old->covariances.size(), old->keyframes.size());
  mapper_.begin_additional(initial_map(50, 48), 1);
  mapper_.transform(Sim3(3, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()), std::nullopt);
  TrackingMapPtr newer = mapper_.tracking_map();
  for (int i = 46; !mapper_.inactive_maps().empty() && i > 8; i -= 2) {
    newer = mapper_.tracking_map();
    insert(i);
  }
  const TrackingMapPtr joined = mapper_.tracking_map();
  ASSERT_EQ(joined->corrections.size(), 2u) << "they were never joined";
  const MapCorrection& correction = *joined->corrections[1];
  EXPECT_NEAR(correction.scale, 1. / 3, 0.1);
  for (const auto& entry : joined->keyframes) ASSERT_EQ(joined->covariances.count(entry.first), 1u);
  int compared = 0;
  for (const auto& [id, covariance] : old->covariances) {
    if (joined->keyframes.count(id) == 0) continue;
    EXPECT_EQ(joined->covariances.at(id), covariance) << id;
    ++compared;
  }
  EXPECT_GT(compared, 2);
  compared = 0;
  for (const auto& [id, covariance] : newer->covariances) {
    const KeyframeId id_now = id + correction.added.keyframes;
    if (joined->keyframes.count(id_now) == 0) continue;
    const Eigen::Matrix<double, 6, 6> now = joined->covariances.at(id_now);
    // Covariances were computed once more before the merge.
    const double ratio = now.topLeftCorner<3, 3>().trace() / covariance.topLeftCorner<3, 3>().trace();
    EXPECT_NEAR(std::sqrt(ratio), correction.scale, 0.4 * correction.scale) << id;
    ++compared;
  }
  EXPECT_GT(compared, 2);
}

// A loaded map has no covariances.
TEST_F(MapperJoiningTest, ARestoredMapFindsItsCovariances) {
  mapper_.initialize(initial_map(0, 2), 0);
  for (int i = 4; i <= 40; i += 2) insert(i);
  const TrackingMapPtr grown = mapper_.tracking_map();
  mapper_.restore(Map(mapper_.map()), 1);
  const TrackingMapPtr restored = mapper_.tracking_map();
  std::vector<double> ratios;
  for (const auto& entry : restored->keyframes) {
    ASSERT_EQ(restored->covariances.count(entry.first), 1u) << entry.first;
    const Eigen::Matrix<double, 6, 6> now = restored->covariances.at(entry.first),
                                      before = grown->covariances.at(entry.first);
    ratios.push_back(std::sqrt(now.topLeftCorner<3, 3>().trace() / before.topLeftCorner<3, 3>().trace()));
  }
  EXPECT_GT(median(ratios), 0.3) << "of standard deviations";
  EXPECT_LT(median(ratios), 3);
}

// The older map is the present one, after a relocalisation or a load, when it is merged with the newer one.
TEST_F(MapperJoiningTest, TheOlderMapsFrameStaysWhicheverIsTracked) {
  mapper_.initialize(initial_map(0, 2), 0);
  const std::uint32_t older = mapper_.tracking_map()->map_id;
  for (int i = 4; i <= 10; i += 2) insert(i);
  const Rigid3 before = mapper_.map().keyframes().begin()->second.camera_from_map;
  mapper_.begin_additional(initial_map(50, 48), 1);
  const std::uint32_t newer = mapper_.tracking_map()->map_id;
  for (int i = 46; i >= 36; i -= 2) insert(i);
  ASSERT_TRUE(mapper_.resume(older, true, 2));
  int last = 10;
  while (!mapper_.inactive_maps().empty() && last < 40) insert(last += 2);
  ASSERT_TRUE(mapper_.inactive_maps().empty()) << "they were never joined";
  const TrackingMapPtr joined = mapper_.tracking_map();
  EXPECT_EQ(joined->map_id, older);
  EXPECT_EQ(joined->epoch, 2u);
  ASSERT_EQ(joined->corrections.size(), 1u);
  EXPECT_EQ(joined->corrections[0]->of_map, newer);
  EXPECT_EQ(joined->corrections[0]->into_map, older);
  mapper_.map().check();
  const Rigid3 after = joined->keyframes.begin()->second.camera_from_map;
  EXPECT_LT((before.inverse().translation - after.inverse().translation).norm(), 0.01);
  mapper_.finish();
  EXPECT_LT(worst_distance_error(), 0.01);
}

// Keyframes this close become redundant with the next one: the keyframe that aligns the maps removes another,
// which can then no longer be a place for the newer map.
TEST_F(MapperJoiningTest, AKeyframeThatHasJustGoneIsNoPlace) {
  mapper_.initialize(initial_map(0, 2), 0);
  const std::uint32_t older = mapper_.tracking_map()->map_id;
  for (int i = 4; i <= 10; i += 2) insert(i);
  mapper_.begin_additional(initial_map(50, 48), 1);
  for (int i = 46; i >= 36; i -= 2) insert(i);
  ASSERT_TRUE(mapper_.resume(older, true, 2));
  std::size_t gone = 0;
  for (int i = 11; !mapper_.inactive_maps().empty() && i < 40; ++i) {
    insert(i);
    gone = mapper_.map().removed_keyframes().size();
  }
  EXPECT_GT(gone, 0u);
  EXPECT_TRUE(mapper_.inactive_maps().empty()) << "they were never joined";
  EXPECT_EQ(mapper_.tracking_map()->map_id, older);
  mapper_.map().check();
}

// Gaps are filled from both sides, so that two maps may have the same images.
TEST_F(MapperJoiningTest, AnImageOfBothMapsIsOneKeyframeOfTheJoinedOne) {
  mapper_.initialize(initial_map(0, 2), 0);
  for (int i = 4; i <= 24; i += 2) insert(i);
  mapper_.begin_additional(initial_map(50, 48), 1);
  for (int i = 46; i >= 20; i -= 2) insert(i, 1);  // maps are not joined while others wait
  ASSERT_EQ(mapper_.inactive_maps().size(), 1u);
  insert(18);
  ASSERT_TRUE(mapper_.inactive_maps().empty()) << "they were never joined";
  EXPECT_TRUE(mapper_.map().removed_keyframes().size() >= 3) << "24, 22 and 20 were in both";
  std::set<std::int64_t> frames;
  for (const auto& [id, keyframe] : mapper_.map().keyframes()) {
    EXPECT_TRUE(frames.insert(keyframe.frame_index).second) << keyframe.frame_index;
  }
  mapper_.map().check();
  mapper_.finish();
  EXPECT_LT(worst_distance_error(), 0.01);
}

TEST_F(MapperJoiningTest, ACandidateRegisteredBeforeTheJoinIsStillUnderstood) {
  mapper_.initialize(initial_map(0, 2), 0);
  for (int i = 4; i <= 10; i += 2) insert(i);
  mapper_.begin_additional(initial_map(24, 22), 1);
  // Registered in the new map, inserted when that has become part of the old one.
  const KeyframeCandidate candidate = candidate_of(21);
  ASSERT_FALSE(HasFailure());
  int last = 22;
  while (!mapper_.inactive_maps().empty() && last > 8) insert(last -= 2);
  ASSERT_TRUE(mapper_.inactive_maps().empty());
  mapper_.insert(candidate);
  mapper_.map().check();
  EXPECT_EQ(mapper_.tracking_map()->keyframes.rbegin()->second.frame_index, 21);
  EXPECT_LT(worst_distance_error(), 0.02);
}

// Corrections of another map do not apply to the ids of this one.
TEST_F(MapperJoiningTest, WhatCorrectedAnotherMapChangesNoCandidateOfThisOne) {
  mapper_.initialize(initial_map(0, 2), 0);
  for (int i = 4; i <= 8; i += 2) insert(i);
  const std::uint32_t first = mapper_.tracking_map()->map_id;
  mapper_.begin_additional(initial_map(40, 42), 1);
  mapper_.transform(Sim3(3, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()), std::nullopt);
  ASSERT_TRUE(mapper_.resume(first, true, 2));
  KeyframeCandidate candidate = candidate_of(10);
  ASSERT_FALSE(HasFailure());
  candidate.corrections = 0;  // it was registered before the other map was rescaled
  mapper_.insert(candidate);
  EXPECT_EQ(mapper_.tracking_map()->keyframes.rbegin()->second.frame_index, 10);
  EXPECT_LT(worst_distance_error(), 0.02);
}

TEST_F(MapperJoiningTest, ACandidateOfAnotherMapIsExcluded) {
  mapper_.initialize(initial_map(0, 2), 0);
  KeyframeCandidate candidate;
  candidate.map_id = mapper_.tracking_map()->map_id + 1;
  candidate.frame = frame(4);
  candidate.reference = 0;
  mapper_.insert(candidate);
  EXPECT_EQ(mapper_.map().keyframes().size(), 2u);
}

// The same wall twice with different surroundings: similar structures are not the same place.
TEST_F(MapperJoiningTest, MapsOfDifferentPlacesStayApart) {
  mapper_.initialize(initial_map(0, 2), 0);
  for (int i = 4; i <= 10; i += 2) insert(i);
  const SyntheticScene here = scene_;
  scene_ = wall(random_);
  // One window of the old place, half a metre wide, is also in the new one.
  for (std::size_t i = 0; i < here.x_in_map.size(); ++i) {
    const Eigen::Vector3d& x = here.x_in_map[i];
    if (std::abs(x.x() - 1) > 0.4 || std::abs(x.y()) > 0.4) continue;
    scene_.x_in_map[i] = x + Eigen::Vector3d(8, 0.2, 0.3);
    here.descriptors.row(static_cast<int>(i)).copyTo(scene_.descriptors.row(static_cast<int>(i)));
  }
  mapper_.begin_additional(initial_map(34, 36), 1);
  for (int i = 38; i <= 48; i += 2) insert(i);
  EXPECT_EQ(mapper_.inactive_maps().size(), 1u);
  mapper_.join_rest();
  EXPECT_EQ(mapper_.inactive_maps().size(), 1u);
}

// Independently moving features stay excluded afterwards.
TEST_F(MapperJoiningTest, AJoinThatDoesNotHoldLeavesTheMapAsItWas) {
  mapper_.initialize(initial_map(0, 2), 0);
  for (int i = 4; i <= 24; i += 2) insert(i);
  InitialMap newer = initial_map(51, 49);
  std::vector<char>& fixed = newer.views[0].fixed;
  for (int f = 0; f < newer.views[0].frame.image->size(); ++f) fixed.push_back(f % 3 == 0);
  mapper_.begin_additional(newer, 1);
  for (int i = 47; i >= 21; i -= 2) insert(i, 1);  // maps are not joined while others wait
  const std::size_t landmarks = mapper_.map().landmarks().size();
  // No point has this much parallax: the two maps share none after culling.
  const MapperOptions usual = options_.mapper(camera_.focal());
  MapperOptions strict = usual;
  strict.mapping.min_parallax_deg = 180;
  mapper_.set_options(strict);
  mapper_.join_rest();
  ASSERT_EQ(mapper_.inactive_maps().size(), 1u);
  EXPECT_EQ(mapper_.map().landmarks().size(), landmarks);
  mapper_.set_options(usual);
  mapper_.finish();
  const Keyframe& first = mapper_.map().keyframes().begin()->second;
  ASSERT_EQ(first.frame_index, 51);
  int others = 0;
  for (std::size_t f = 0; f < fixed.size(); ++f) {
    others += !fixed[f] && first.landmark_of_feature[f] != kNoLandmark;
    EXPECT_TRUE(!fixed[f] || first.landmark_of_feature[f] == kNoLandmark) << f;
  }
  EXPECT_GT(others, 100);
  mapper_.join_rest();
  EXPECT_TRUE(mapper_.inactive_maps().empty()) << "they do meet";
}

// The newest map can be merged with the second only, and that one with the first.
TEST_F(MapperJoiningTest, OfARowOfMapsOneIsLeft) {
  mapper_.initialize(initial_map(0, 2), 0);
  for (int i = 4; i <= 12; i += 2) insert(i);
  const std::uint32_t first = mapper_.tracking_map()->map_id;
  for (const int begin : {14, 30}) {
    mapper_.begin_additional(initial_map(begin, begin + 2), 1 + begin);
    for (int i = begin + 4; i <= begin + 14; i += 2) insert(i, 1);  // maps are not joined while others wait
  }
  ASSERT_EQ(mapper_.inactive_maps().size(), 2u);
  mapper_.join_rest();
  EXPECT_TRUE(mapper_.inactive_maps().empty());
  EXPECT_EQ(mapper_.tracking_map()->map_id, first);
  mapper_.finish();
  EXPECT_LT(worst_distance_error(), 0.02);
}

// The corrections may not have been read: at the end of a recording many maps are merged at once.
TEST_F(MapperJoiningTest, HoweverManyCorrectionsAreKeptUntilAKeyframeComes) {
  mapper_.initialize(initial_map(0, 2), 0);
  for (int i = 0; i < 100; ++i) {
    mapper_.transform(Sim3(1.01, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()), std::nullopt);
  }
  EXPECT_EQ(mapper_.tracking_map()->corrections.size(), 100u);
  insert(4);
  EXPECT_LT(mapper_.tracking_map()->corrections.size(), 100u);
}

TEST_F(MapperJoiningTest, AMapIsGoneBackTo) {
  mapper_.initialize(initial_map(0, 2), 0);
  const std::uint32_t first = mapper_.tracking_map()->map_id;
  mapper_.begin_additional(initial_map(50, 48), 1);
  const std::uint32_t second = mapper_.tracking_map()->map_id;
  EXPECT_FALSE(mapper_.resume(99, true, 2));
  EXPECT_EQ(mapper_.tracking_map()->map_id, second) << "the present one goes on";
  EXPECT_EQ(mapper_.tracking_map()->epoch, 2u);
  ASSERT_TRUE(mapper_.resume(first, true, 3));
  EXPECT_EQ(mapper_.tracking_map()->map_id, first);
  EXPECT_EQ(mapper_.tracking_map()->epoch, 3u);
  EXPECT_EQ(mapper_.inactive_maps(), std::vector<std::uint32_t>{second});
  ASSERT_TRUE(mapper_.resume(second, false, 4));
  EXPECT_TRUE(mapper_.inactive_maps().empty()) << "the first was dropped";
}

TEST_F(MapperJoiningTest, InactiveMapsHoldNoMoreThanACappedMapMay) {
  MapperOptions capped = options_.mapper(camera_.focal());
  capped.mapping.max_keyframes = 5;
  mapper_.set_options(capped);
  mapper_.initialize(initial_map(0, 2), 0);
  insert(4);
  const std::uint32_t first = mapper_.tracking_map()->map_id;
  mapper_.begin_additional(initial_map(50, 48), 1);
  const std::uint32_t second = mapper_.tracking_map()->map_id;
  mapper_.begin_additional(initial_map(30, 28), 2);
  EXPECT_EQ(mapper_.inactive_maps(), (std::vector<std::uint32_t>{first, second})) << "five keyframes";
  const std::uint32_t third = mapper_.tracking_map()->map_id;
  insert(26);
  mapper_.begin_additional(initial_map(14, 12), 3);
  EXPECT_EQ(mapper_.inactive_maps(), std::vector<std::uint32_t>{third}) << "the one that was just left stays";
  EXPECT_EQ(mapper_.tracking_map()->inactive_maps, std::vector<std::uint32_t>{third});
}

}  // namespace
}  // namespace mono_pose_tracker
