#include "mono_pose_tracker/mapping/other_body.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr double kDegree = M_PI / 180;

SyntheticScene box(int points, const Eigen::Vector3d& middle, const Eigen::Vector3d& half, Random& random) {
  std::vector<Eigen::Vector3d> x;
  for (int i = 0; i < points; ++i) {
    x.push_back(middle + Eigen::Vector3d(half.x() * random.uniform(-1, 1), half.y() * random.uniform(-1, 1),
                                         half.z() * random.uniform(-1, 1)));
  }
  return SyntheticScene(x, random);
}

// A head that turns by 6 degrees from keyframe to keyframe, before a room behind a camera in the hand, which
// sways. Of the map are the poses only: its landmarks are not asked, but for their middle.
class OtherBodyTest : public testing::Test {
 protected:
  static constexpr int kKeyframes = 8;

  static Rigid3 camera_from_head(int k) {
    return {Eigen::Quaterniond(Eigen::AngleAxisd(6 * k * kDegree, Eigen::Vector3d::UnitY())),
            Eigen::Vector3d(0.05 * std::sin(k), 0, 3)};
  }
  static Rigid3 camera_from_room(int k) {
    return {Eigen::Quaterniond(Eigen::AngleAxisd(1.5 * std::sin(2 * k) * kDegree, Eigen::Vector3d::UnitX())),
            Eigen::Vector3d(0.15 * std::sin(1.3 * k), 0.15 * std::cos(1.7 * k), 0)};
  }

  Map map_with(bool is_of_head, int head_points, int room_points) {
    const SyntheticScene head = box(head_points, {0, 0, 0}, {0.5, 0.6, 0.5}, random_);
    const SyntheticScene room = box(room_points, {0, 0, 8}, {4, 3, 2}, random_);
    Map map;
    for (int k = 0; k < kKeyframes; ++k) {
      FeatureSet both = synthetic_frame(head, camera_, camera_from_head(k), 0.3, k, random_).image->set;
      head_features_.push_back(both.size());
      if (room_points > 0) {
        const FeatureSet other =
            synthetic_frame(room, camera_, camera_from_room(k), 0.3, k, random_).image->set;
        both.features.insert(both.features.end(), other.features.begin(), other.features.end());
        cv::vconcat(both.descriptors.clone(), other.descriptors, both.descriptors);
      }
      both.bearings.clear();
      map.add_keyframe(
          k, k, is_of_head ? camera_from_head(k) : camera_from_room(k),
          make_image_features(std::move(both), cv::Mat(480, 640, CV_8UC1, cv::Scalar(128)), camera_));
    }
    for (const Eigen::Vector3d& x : (is_of_head ? head : room).x_in_map) map.add_landmark(x);
    return map;
  }

  OtherBody find(const Map& map) const {
    RansacOptions ransac;
    ransac.threshold = 2 / camera_.focal();
    return find_other_body(map, {}, MatchOptions(), ransac, 1);
  }

  Random random_{5};
  CameraModel camera_ = synthetic_camera();
  std::vector<int> head_features_;  // by keyframe: the first ones
};

TEST_F(OtherBodyTest, AHeadBeforeAMapOfTheRoomTurnsMore) {
  const OtherBody body = find(map_with(false, 60, 300));
  ASSERT_TRUE(body.exists());
  EXPECT_FALSE(body.turns_plainly_less());
  EXPECT_GT(body.other_turn, 3 * body.map_turn);
  EXPECT_FALSE(body.is_comparable()) << "one point in six";
}

TEST_F(OtherBodyTest, TheRoomBehindAMapOfTheHeadTurnsLess) {
  const OtherBody body = find(map_with(true, 150, 200));
  ASSERT_TRUE(body.exists());
  EXPECT_TRUE(body.turns_plainly_less());
  EXPECT_TRUE(body.is_comparable());
}

TEST_F(OtherBodyTest, OneBodyHasNoOther) { EXPECT_FALSE(find(map_with(true, 200, 0)).exists()); }

TEST_F(OtherBodyTest, ASampleTellsItAsWell) {
  Map map = map_with(true, 150, 200);
  RansacOptions ransac;
  ransac.threshold = 2 / camera_.focal();
  const OtherBody sample = sample_other_body(map, MatchOptions(), ransac, 1);
  EXPECT_EQ(sample.pairs, kKeyframes - 1);
  EXPECT_TRUE(sample.is_comparable());
  EXPECT_FALSE(sample_other_body(map_with(true, 200, 0), MatchOptions(), ransac, 1).is_comparable());
  EXPECT_FALSE(sample_other_body(Map(), MatchOptions(), ransac, 1).exists());
}

TEST_F(OtherBodyTest, TracksTellWhichFeaturesAreWhose) {
  const Map map = map_with(false, 100, 300);
  const OtherBody body = find(map);
  int right = 0, wrong = 0, of_head = 0;
  for (const BodyTrack& track : body.tracks) {
    const auto& features = map.keyframe(static_cast<KeyframeId>(track.from_index))->image->set.features;
    int f = 0;
    while (features[f].pixel != track.from) ++f;
    const bool is_head = f < head_features_[track.from_index];
    of_head += is_head;
    (is_head == track.is_other ? right : wrong) += 1;
  }
  EXPECT_GT(of_head, 400);
  EXPECT_LT(wrong, 0.05 * right);
}

TEST_F(OtherBodyTest, ImagesBetweenTheKeyframesAreInTheTracks) {
  const Map map = map_with(false, 100, 300);
  RansacOptions ransac;
  ransac.threshold = 2 / camera_.focal();
  Map sparse;
  std::vector<PosedImage> between;
  for (const auto& [id, k] : map.keyframes()) {
    if (id % 2 == 0) sparse.add_keyframe(k.frame_index, k.stamp_ns, k.camera_from_map, k.image);
    if (id % 2 != 0) between.push_back({k.frame_index, k.camera_from_map, k.image});
  }
  const OtherBody body = find_other_body(sparse, between, MatchOptions(), ransac, 1);
  ASSERT_FALSE(body.tracks.empty());
  for (const BodyTrack& track : body.tracks) EXPECT_EQ(track.to_index, track.from_index + 1);
}

TEST_F(OtherBodyTest, TheTurnIsWhatTheCamerasSpan) {
  EXPECT_NEAR(turn_before_cameras(map_with(true, 200, 0)) / kDegree, 6.0 * (kKeyframes - 1), 3);
  EXPECT_LT(turn_before_cameras(map_with(false, 50, 200)) / kDegree, 5);
}

}  // namespace
}  // namespace mono_pose_tracker
