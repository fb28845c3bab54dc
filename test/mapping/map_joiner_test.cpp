#include "mapping/map_joiner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "mapping/landmark_pose.h"
#include "mono_pose_tracker/tracking/tracker_options.h"
#include "support/synthetic_map.h"

namespace mono_pose_tracker {
namespace {

class MapJoinerTest : public testing::Test {
 protected:
  Map map_from(const std::vector<Rigid3>& poses) const { return map_of(poses, camera_, camera_); }

  const CameraModel camera_ = synthetic_camera();
  const MapperOptions options_ = TrackerOptions().mapper(camera_.focal());
  const std::vector<Rigid3> way_ = round_about();
  const Map other_ = map_from({way_.begin(), way_.begin() + 7});
};

TEST_F(MapJoinerTest, TheCamerasOfBothMapsDetermineTheAlignment) {
  Map map = map_from({way_.begin() + 5, way_.end()});
  map.rescale(3);
  const std::optional<MapAlignment> alignment = align_maps(options_, map, {0, 1}, other_, 6);
  ASSERT_TRUE(alignment);
  EXPECT_NEAR(std::log(3 * alignment->other_from_map.scale), 0, 0.01);
  // Frame 5 of the way is in both maps.
  const Eigen::Vector3d center = map.keyframe(0)->center_in_map();
  EXPECT_LT((alignment->other_from_map * center - other_.keyframe(5)->center_in_map()).norm(), 0.02);
  for (const auto& [id, matches] : alignment->found) {
    for (const auto& [feature, landmark] : matches) {
      const LandmarkId own = map.keyframe(id)->landmark_of_feature[feature];
      if (own == kNoLandmark) continue;
      EXPECT_LT(
          (alignment->other_from_map * map.landmark(own)->x_in_map - other_.landmark(landmark)->x_in_map)
              .norm(),
          0.2);
    }
  }
  EXPECT_FALSE(alignment->found_in_other.empty());
}

TEST_F(MapJoinerTest, TheInverseAlignsTheOtherWay) {
  const Map map = map_from({way_.begin() + 5, way_.end()});
  const std::optional<MapAlignment> alignment = align_maps(options_, map, {0, 1}, other_, 6);
  ASSERT_TRUE(alignment);
  const MapAlignment inverse = alignment->inverse();
  const Eigen::Vector3d x(1, 2, 3);
  EXPECT_LT((inverse.other_from_map * (alignment->other_from_map * x) - x).norm(), 1e-9);
  EXPECT_EQ(inverse.found, alignment->found_in_other);
  EXPECT_EQ(inverse.found_in_other, alignment->found);
}

TEST_F(MapJoinerTest, OneKeyframeAlignsNone) {
  const Map map = map_from({way_.begin() + 5, way_.end()});
  ASSERT_TRUE(locate(options_, other_, 6, *map.keyframe(1)->image).found);
  EXPECT_FALSE(align_maps(options_, map, {1}, other_, 6));
}

// The map with only `count` features of a keyframe, from `first` on.
Map with_masked(const Map& map, KeyframeId id, int first, int count) {
  std::vector<Keyframe> keyframes;
  for (const auto& entry : map.keyframes()) keyframes.push_back(entry.second);
  std::vector<char> flags(map.keyframe(id)->image->size(), 0);
  std::fill_n(flags.begin() + first, count, 1);
  keyframes[id].image = select_features(*keyframes[id].image, flags);
  std::vector<Landmark> landmarks;
  for (const LandmarkId l : map.landmark_ids()) {
    Landmark landmark = *map.landmark(l);
    std::vector<Observation> kept;
    for (Observation o : landmark.observations) {
      if (o.keyframe == id && !flags[o.feature]) continue;
      if (o.keyframe == id) o.feature -= first;
      kept.push_back(o);
    }
    landmark.observations = std::move(kept);
    if (landmark.observations.size() >= 2) landmarks.push_back(landmark);
  }
  return Map::restore(std::move(keyframes), std::move(landmarks), {}, ScaleSource::kMapUnits);
}

TEST_F(MapJoinerTest, AnImageWithTwoMasksIsTwoKeyframes) {
  constexpr KeyframeId kMasked = 3;
  const int size = other_.keyframe(kMasked)->image->size();
  const Map older = with_masked(other_, kMasked, 0, size - 10),
            newer = with_masked(other_, kMasked, 10, size - 10);
  MapAlignment alignment;
  for (const KeyframeId id : {0, 1}) {
    for (int f = 0; f < other_.keyframe(id)->image->size(); ++f) {
      const LandmarkId l = older.keyframe(id)->landmark_of_feature[f];
      if (l != kNoLandmark) alignment.found[id].emplace(f, l);
    }
  }
  const JoinedMaps joined = join_maps(options_, older, newer, alignment);
  EXPECT_TRUE(joined.holds);
  joined.map.check();
  EXPECT_EQ(joined.map.keyframes().size(), other_.keyframes().size() + 1);
}

// Two cameras in front of a wall, one from its left, one from its right: the common part is a strip at the
// edge of their images.
TEST_F(MapJoinerTest, AStripOfAWallIsNotTurnedOver) {
  constexpr double kDistance = 2.4, kHalfStrip = 0.3, kHalfHeight = 0.25, kStep = 0.1;
  const CameraModel camera(with_focal(1.6));
  const MapperOptions options = TrackerOptions().mapper(camera.focal());
  const double half_view = kDistance * 0.5 * camera.width() / camera.focal();
  int met = 0;
  for (int seed = 0; seed < 12; ++seed) {
    const double noise_px = seed % 2 == 0 ? 0.3 : 0.5;
    Random random(seed);
    std::vector<Eigen::Vector3d> wall;
    for (int i = 0; i < 3000; ++i)
      wall.emplace_back(random.uniform(-4, 4), random.uniform(-kHalfHeight, kHalfHeight),
                        kDistance + random.uniform(0, 0.02));
    const SyntheticScene scene(wall, random);
    // Looks at the centre of the wall.
    const auto from_side = [&](double side) {
      Map map;
      std::vector<LandmarkId> landmark_of(wall.size(), kNoLandmark);
      for (int k = 0; k < 9; ++k) {
        const double x = side * (half_view - kHalfStrip + kStep * (8 - k));
        std::vector<int> point_of;
        const Rigid3 pose = camera_at({x, 0.03 * std::sin(1.7 * k), 0.03 * std::cos(2.3 * k)});
        const Frame frame = synthetic_frame(scene, camera, pose, noise_px, k, random, &point_of);
        const KeyframeId id = map.add_keyframe(k, frame.stamp_ns, pose, frame.image);
        for (std::size_t f = 0; f < point_of.size(); ++f) {
          LandmarkId& l = landmark_of[point_of[f]];
          if (l == kNoLandmark) l = map.add_landmark(wall[point_of[f]]);
          map.add_observation(l, id, static_cast<int>(f));
        }
      }
      for (const LandmarkId l : map.landmark_ids()) {
        if (map.landmark(l)->observations.size() < 2) map.remove_landmark(l);
      }
      adjust_map(BundleOptions(), &map);
      return map;
    };
    const Map left = from_side(-1), right = from_side(1);
    const std::optional<MapAlignment> alignment = align_maps(options, right, {8, 7}, left, 8);
    if (!alignment) continue;
    ++met;
    EXPECT_LT(alignment->other_from_map.rotation.angularDistance(Eigen::Quaterniond::Identity()), 0.07)
        << seed;
  }
  EXPECT_GE(met, 6);
}

// A baseline from camera shake: 0.2 px of parallax.
TEST_F(MapJoinerTest, PointsWithoutParallaxTellNoScale) {
  std::vector<Rigid3> still;
  for (int k = 0; k < 5; ++k) still.push_back(camera_at({0.002 * k - 0.1, 0, 0}));
  Map map = map_from(still);
  Random random(5);
  const Eigen::Vector3d center = map.keyframe(2)->center_in_map();
  for (const LandmarkId l : map.landmark_ids()) {
    const Eigen::Vector3d& x = map.landmark(l)->x_in_map;
    map.set_position(l, center + std::exp(random.uniform(-1, 1)) * (x - center));
  }
  ASSERT_TRUE(locate(options_, other_, 5, *map.keyframe(1)->image).found);
  EXPECT_FALSE(align_maps(options_, map, {1, 2}, other_, 5));
}

}  // namespace
}  // namespace mono_pose_tracker
