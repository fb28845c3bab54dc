#include "mapping/static_background.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mapping/map_motions.h"
#include "support/two_objects.h"

namespace mono_pose_tracker {
namespace {

constexpr int kImages = 10;

using Path = Rigid3 (*)(int);

Rigid3 stands_still(int) { return Rigid3(); }

// Back and forth: it ends where it began.
Rigid3 nods(int k) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(15 * std::sin(0.6 * k) * kDegree, Eigen::Vector3d::UnitX())),
          Eigen::Vector3d(0, 0, 3)};
}

// By less than neighbouring images can show.
Rigid3 turns_slowly(int k) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(0.5 * k * kDegree, Eigen::Vector3d::UnitY())),
          Eigen::Vector3d(0.004 * k, 0, 3)};
}

Rigid3 stands_before(int) { return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 3)}; }

Rigid3 drives_at_it(int k) { return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 3 - 0.15 * k)}; }

class StaticBackgroundTest : public testing::Test {
 protected:
  // The features of the one come first.
  std::vector<SeenImage> see(const SyntheticScene& one, Path camera_from_one, const SyntheticScene& other,
                             Path camera_from_other) {
    std::vector<SeenImage> images;
    for (int k = 0; k < kImages; ++k) {
      FeatureSet both = synthetic_frame(one, camera_, camera_from_one(k), kNoise, k, random_).image->set;
      of_one_.push_back(both.size());
      const FeatureSet rest =
          synthetic_frame(other, camera_, camera_from_other(k), kNoise, k, random_).image->set;
      both.features.insert(both.features.end(), rest.features.begin(), rest.features.end());
      cv::vconcat(both.descriptors.clone(), rest.descriptors, both.descriptors);
      both.bearings.clear();
      const cv::Mat image(camera_.height(), camera_.width(), CV_8UC1, cv::Scalar(128));
      images.push_back({k, make_image_features(std::move(both), image, camera_)});
    }
    return images;
  }

  std::vector<SeenImage> see_head(Path camera_from_head, int wall_points,
                                  Path camera_from_wall = stands_still) {
    return see(box(150, {0, 0, 0}, {0.5, 0.6, 0.5}, random_), camera_from_head,
               box(wall_points, {0, 0, 5}, {2.4, 1.8, 0.3}, random_), camera_from_wall);
  }

  StaticBackground find(const std::vector<SeenImage>& images, bool object_turns = false, int threads = 1,
                        const LeastStill& least = MotionSegmentationOptions().plainly_static) const {
    MotionSegmentationOptions options;
    options.threads = threads;
    StaticSegmentation segmentation(options);
    for (const SeenImage& image : images) segmentation.add(image);
    return segmentation.find(least, object_turns);
  }

  // Share of tracks assigned to the moving object, of the head's and of the rest.
  std::pair<double, double> share_of_moving(const std::vector<SeenImage>& images,
                                            const std::vector<MotionTrack>& tracks) const {
    double head = 0, head_moves = 0, wall = 0, wall_moves = 0;
    for (const MotionTrack& track : tracks) {
      const auto& features = images[track.from_index].image->set.features;
      int f = 0;
      while (features[f].pixel != track.from) ++f;
      const bool is_head = f < of_one_[track.from_index];
      (is_head ? head : wall) += 1;
      (is_head ? head_moves : wall_moves) += track.is_other;
    }
    return {head_moves / head, wall_moves / wall};
  }

  static constexpr double kNoise = 0.2;  // px
  Random random_{7};
  CameraModel camera_ = synthetic_camera();
  std::vector<int> of_one_;
};

TEST_F(StaticBackgroundTest, AHeadThatTurnsIsToldFromAWall) {
  const std::vector<SeenImage> images = see_head(TwoObjects::camera_from_head, 100);
  const StaticBackground background = find(images);
  ASSERT_TRUE(background.exists);
  const auto [head, wall] = share_of_moving(images, background.tracks);
  EXPECT_GT(head, 0.95);
  EXPECT_LT(wall, 0.05);
}

TEST_F(StaticBackgroundTest, AWallOfFewFeaturesIsEnough) {
  EXPECT_TRUE(find(see_head(TwoObjects::camera_from_head, 40)).exists);
}

TEST_F(StaticBackgroundTest, AFewFeaturesAreAFaintOne) {
  const std::vector<SeenImage> few = see_head(TwoObjects::camera_from_head, 11);
  EXPECT_FALSE(find(few).exists);
  EXPECT_TRUE(find(few, false, 1, MotionSegmentationOptions().faintly_static).exists);
  const std::vector<SeenImage> moves =
      see_head(TwoObjects::camera_from_head, 300, TwoObjects::camera_from_room);
  EXPECT_FALSE(find(moves, false, 1, MotionSegmentationOptions().faintly_static).exists);
}

TEST_F(StaticBackgroundTest, WhatComesBackToItsPlaceHasNotStoodThere) {
  const std::vector<SeenImage> images = see_head(nods, 100);
  const StaticBackground background = find(images);
  ASSERT_TRUE(background.exists);
  EXPECT_GT(share_of_moving(images, background.tracks).first, 0.9);
}

// In neighbouring images both it and the wall keep their place.
TEST_F(StaticBackgroundTest, WhatMovesSlowlyHasNotStoodStill) {
  const std::vector<SeenImage> images = see_head(turns_slowly, 100);
  const StaticBackground background = find(images);
  ASSERT_TRUE(background.exists);
  EXPECT_GT(share_of_moving(images, background.tracks).first, 0.8);
}

TEST_F(StaticBackgroundTest, ACameraThatMovesHasNone) {
  EXPECT_FALSE(find(see_head(TwoObjects::camera_from_head, 300, TwoObjects::camera_from_room)).exists);
  EXPECT_FALSE(find(see_head(drives_at_it, 300, drives_at_it)).exists);
}

TEST_F(StaticBackgroundTest, ACameraThatStandsBeforeNothingThatMovesHasNone) {
  EXPECT_FALSE(find(see_head(stands_before, 300)).exists);
}

TEST_F(StaticBackgroundTest, WhatIsFixedToTheCameraIsNoneUnlessAnObjectIsLookedFor) {
  const std::vector<SeenImage> images =
      see(box(60, {0, 0, 0}, {0.3, 0.3, 0.3}, random_), stands_before,
          box(300, {0, 0, 6}, {4, 3, 2}, random_), TwoObjects::camera_from_room);
  EXPECT_FALSE(find(images).exists);
  EXPECT_TRUE(find(images, true).exists);
}

TEST_F(StaticBackgroundTest, FewImagesTellNothing) {
  std::vector<SeenImage> images = see_head(TwoObjects::camera_from_head, 100);
  images.resize(2);
  EXPECT_FALSE(find(images).exists);
  images.resize(1);
  EXPECT_FALSE(find(images).exists);
  EXPECT_FALSE(find({}).exists);
}

TEST_F(StaticBackgroundTest, AnyNumberOfThreadsTellsTheSame) {
  const std::vector<SeenImage> images = see_head(TwoObjects::camera_from_head, 100);
  const std::vector<MotionTrack> one = find(images, false, 1).tracks, many = find(images, false, 3).tracks;
  ASSERT_EQ(one.size(), many.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].from, many[i].from);
    EXPECT_EQ(one[i].is_other, many[i].is_other);
  }
}

TEST_F(StaticBackgroundTest, AMapsKeyframesTellItAsWell) {
  Map map;
  for (const SeenImage& seen : see_head(TwoObjects::camera_from_head, 100)) {
    map.add_keyframe(seen.frame_index, seen.frame_index, Rigid3(), seen.image);
  }
  EXPECT_TRUE(find(images_in_time(map)).exists);
  EXPECT_FALSE(find(images_in_time(Map())).exists);
}

TEST_F(StaticBackgroundTest, KeyframesTellItAsTheyCome) {
  const std::vector<SeenImage> images = see_head(TwoObjects::camera_from_head, 100);
  MotionWatch watch;
  watch.add_image(images[0], false);
  EXPECT_FALSE(watch.object()) << "of a map that has begun elsewhere";
  watch.begin({images[0], images[1]});
  for (std::size_t i = 2; i < images.size(); ++i) {
    watch.add_image(images[i], false);
    EXPECT_EQ(watch.object() != nullptr, i >= 8) << i;
  }
  EXPECT_EQ(watch.object()->image, images.back().image);
  int right = 0, wrong = 0;
  for (int f = 0; f < images.back().image->size(); ++f) {
    const FeatureMotion side = watch.object()->sides[f];
    if (side == FeatureMotion::kUnknown) continue;
    const bool is_head = f < of_one_.back();
    (is_head == (side == FeatureMotion::kTurns) ? right : wrong) += 1;
  }
  EXPECT_GT(right, 100);
  EXPECT_LT(20 * wrong, right);
  watch.end_background();
  EXPECT_FALSE(watch.object());
}

TEST_F(StaticBackgroundTest, ACameraThatMovesTellsNoneAsItGoes) {
  MotionWatch watch;
  watch.begin({});
  for (const SeenImage& image : see_head(TwoObjects::camera_from_head, 300, TwoObjects::camera_from_room)) {
    watch.add_image(image, false);
    EXPECT_FALSE(watch.object());
  }
}

}  // namespace
}  // namespace mono_pose_tracker
