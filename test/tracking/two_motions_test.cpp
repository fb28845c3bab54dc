#include "tracking/two_motions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "common/rotation.h"
#include "support/synthetic_views.h"
#include "tracking/bootstrapper.h"

namespace mono_pose_tracker {
namespace {

constexpr double kStillNoise = 0.15;  // px, of a static feature
constexpr int kStill = 300, kMoving = 150;

// Points in a box of half a unit, 3 units away, rotated by `yaw` about its centre.
std::vector<Eigen::Vector3d> object_points(Random& random) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < kMoving; ++i) {
    points.emplace_back(random.uniform(-0.5, 0.5), random.uniform(-0.6, 0.6), random.uniform(-0.5, 0.5));
  }
  return points;
}

Rigid3 camera_from_object(double yaw) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY())), Eigen::Vector3d(0, 0, 3)};
}

class TwoMotionsTest : public testing::Test {
 protected:
  TwoMotionsTest() : object_(object_points(random_), random_), wall_(wall(), random_) {}

  std::vector<Eigen::Vector3d> wall() {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < kStill; ++i) {
      points.emplace_back(random_.uniform(-2.4, 2.4), random_.uniform(-1.8, 1.8), random_.uniform(4.5, 5));
    }
    return points;
  }

  // The first features are the wall's, the last ones the object's.
  Frame frame(double yaw, const Rigid3& camera_from_wall = Rigid3()) {
    return frame_of(camera_from_wall, camera_from_wall * camera_from_object(yaw));
  }

  Frame frame_of(const Rigid3& camera_from_wall, const Rigid3& camera_from_object) {
    const Frame wall = synthetic_frame(wall_, camera_, camera_from_wall, kStillNoise, index_, random_);
    const Frame object = synthetic_frame(object_, camera_, camera_from_object, kStillNoise, index_, random_);
    FeatureSet both = wall.image->set;
    both.bearings.clear();
    both.features.insert(both.features.end(), object.image->set.features.begin(),
                         object.image->set.features.end());
    cv::vconcat(wall.image->set.descriptors, object.image->set.descriptors, both.descriptors);
    wall_features_ = wall.image->size();
    const cv::Mat image(camera_.height(), camera_.width(), CV_8UC1, cv::Scalar(128));
    const std::int64_t index = index_++;
    return {index, index * 100000000, make_image_features(std::move(both), image, camera_)};
  }

  // A frame with features held in front of the camera, which moves along the wall.
  Frame held_before(const Rigid3& camera_from_wall) {
    return frame_of(camera_from_wall, camera_from_object(0));
  }

  TwoMotions motions(const Frame& first, const Frame& second, const TrackerOptions& options = {}) {
    std::vector<int> second_of_first(first.image->size(), -1);
    for (const Match& m :
         match_descriptors(first.image->set.descriptors, second.image->set.descriptors, MatchOptions())) {
      second_of_first[m.first] = m.second;
    }
    return find_two_motions(*first.image, *second.image, second_of_first, {}, camera_, options);
  }

  Random random_{5};
  CameraModel camera_ = synthetic_camera();
  SyntheticScene object_, wall_;
  std::int64_t index_ = 0;
  int wall_features_ = 0;  // of the last frame
};

TEST_F(TwoMotionsTest, AnObjectThatTurnsBeforeAStillWallIsFound) {
  const Frame first = frame(0), second = frame(3 * kDegree);
  const TwoMotions found = motions(first, second);
  EXPECT_TRUE(found.found);
  EXPECT_GT(found.still.size(), 0.9 * wall_features_);
  EXPECT_GT(found.moved_of_first.size(), 40u);
  for (const int f : found.moved_of_first) EXPECT_GE(f, wall_features_);
}

// A plain wall has few features, and shoulders move slightly.
TEST_F(TwoMotionsTest, AFewFeaturesThatStandNearlyStillAreEnough) {
  std::vector<Eigen::Vector3d> few;
  for (int i = 0; i < 20; ++i) few.push_back(wall_.x_in_map[i]);
  wall_ = SyntheticScene(few, random_);
  const Frame first = frame(0), second = frame(6 * kDegree, camera_at({0.003, 0, 0}));  // 0.4 px on the wall
  const TwoMotions found = motions(first, second);
  EXPECT_TRUE(found.found);
  EXPECT_GE(found.still.size(), 12u);
  for (const int f : found.moved_of_first) EXPECT_GE(f, 20);
}

TEST_F(TwoMotionsTest, WhatWasElsewhereMeanwhileHasNotStoodStill) {
  const Frame first = frame(0), second = frame(6 * kDegree);
  std::vector<int> second_of_first(first.image->size(), -1);
  for (const Match& m :
       match_descriptors(first.image->set.descriptors, second.image->set.descriptors, MatchOptions())) {
    second_of_first[m.first] = m.second;
  }
  const std::vector<char> all_have_moved(first.image->size(), 1);
  const TwoMotions found = find_two_motions(*first.image, *second.image, second_of_first, all_have_moved,
                                            camera_, TrackerOptions());
  EXPECT_FALSE(found.found);
  EXPECT_TRUE(found.still.empty());
}

TEST_F(TwoMotionsTest, WhatIsHeldBeforeAMovingCameraIsNoBackground) {
  const Frame first = held_before(Rigid3()), second = held_before(camera_at({0.15, 0.05, 0}, 1 * kDegree));
  const TwoMotions seen = motions(first, second);
  EXPECT_FALSE(seen.found);
  EXPECT_TRUE(seen.is_ego_vehicle);
  EXPECT_GT(seen.still_of_first.size(), 0.9 * kMoving);
  for (const int f : seen.still_of_first) EXPECT_GE(f, first.image->size() - kMoving);
  TrackerOptions turning;
  turning.segmentation.body = "turning";
  EXPECT_TRUE(motions(first, second, turning).found) << "the wall may be a printed roll that is drawn past";
}

// The camera moves on until the first reference is out of view and is replaced.
TEST_F(TwoMotionsTest, AMapIsBegunWithoutWhatIsHeldBeforeTheCamera) {
  TrackerOptions options;
  options.bootstrap.min_parallax_deg = 1e3;  // never: the reference is replaced
  Bootstrapper never(options, camera_);
  for (int i = 0; i < 30; ++i) never.add(held_before(camera_at({0.2 * i, 0.02 * i, 0}, 1.5 * i * kDegree)));
  Bootstrapper bootstrapper(TrackerOptions(), camera_);
  for (int i = 0; i < 12; ++i) {
    const BootstrapReport report =
        bootstrapper.add(held_before(camera_at({0.05 * i, 0.01 * i, 0}, 0.3 * i * kDegree)));
    if (!report.map) continue;
    EXPECT_GT(report.map->points.size(), 50u);
    for (const InitialMap::Point& point : report.map->points) {
      EXPECT_LT(point.observations[0].second, report.map->views[0].frame.image->size() - kMoving);
    }
    return;
  }
  FAIL() << "no map";
}

// A bonnet below a street with a motion of a metre between images.
class BonnetTest : public TwoMotionsTest {
 protected:
  BonnetTest() {
    std::vector<Eigen::Vector3d> bonnet, street;
    for (int i = 0; i < kMoving; ++i) {
      const double x =
          i % 3 != 1 ? random_.uniform(-0.4, 0.4) : (i % 6 == 1 ? 1 : -1) * random_.uniform(0.42, 0.52);
      bonnet.emplace_back(x, random_.uniform(0.2, 0.39), random_.uniform(1, 1.1));
    }
    for (int i = 0; i < 3000; ++i) {
      street.emplace_back(i % 2 == 0 ? -2.5 : 2.5, random_.uniform(-0.8, 0.8), random_.uniform(4, 80));
    }
    object_ = SyntheticScene(bonnet, random_);
    street_ = std::make_unique<SyntheticScene>(street, random_);
    never_.bootstrap.min_parallax_deg = 1e3;  // a map
  }

  // The street from 4 to 12 metres ahead: SIFT does not match features that are three times as large.
  Frame after(double metres, const Rigid3& camera_from_bonnet = Rigid3()) {
    wall_.x_in_map.clear();
    wall_.descriptors = cv::Mat();
    for (std::size_t i = 0; i < street_->x_in_map.size(); ++i) {
      const double ahead = street_->x_in_map[i].z() - metres;
      if (ahead < 4 || ahead > 12) continue;
      wall_.x_in_map.push_back(street_->x_in_map[i]);
      wall_.descriptors.push_back(street_->descriptors.row(static_cast<int>(i)));
    }
    return frame_of(camera_at({0, 0, metres}, 0), camera_from_bonnet);
  }

  std::unique_ptr<SyntheticScene> street_;
  TrackerOptions never_;
};

// After some metres, matches with the first view are left only in the centre of the image.
TEST_F(BonnetTest, WhatTheViewHasReachedRoundOnceIsNoBackgroundLater) {
  const Frame first = after(0);
  int found = 0;
  for (int i = 1; i < 12; ++i) found += motions(first, after(0.5 * i)).found;
  EXPECT_GT(found, 3) << "alone they look like an object before a background";
  Bootstrapper bootstrapper(never_, camera_);
  for (int i = 0; i < 12; ++i) {
    EXPECT_TRUE(bootstrapper.add(after(0.5 * i)).static_background.empty()) << i;
  }
}

// The bonnet always matches the first view.
TEST_F(BonnetTest, TheReferenceIsReplacedWhenTheViewHasGoneOn) {
  Bootstrapper bootstrapper(never_, camera_);
  for (int i = 0; i < 25; ++i) bootstrapper.add(after(i));
  const std::vector<SeenMotion> motions = bootstrapper.motions();
  const auto moved = std::count_if(motions.begin(), motions.end(),
                                   [](const SeenMotion& m) { return (m.to_px - m.from_px).norm() > 10; });
  EXPECT_GE(moved, never_.bootstrap.min_matches);
}

// Masks with some of the images only: flags from an earlier image do not apply to this map.
TEST_F(TwoMotionsTest, WhatIsFixedIsToldByTheNewestImageAlone) {
  Bootstrapper bootstrapper(TrackerOptions(), camera_);
  for (int i = 0; i < 12; ++i) {
    Frame frame = held_before(camera_at({0.05 * i, 0.01 * i, 0}, 0.3 * i * kDegree));
    frame.is_masked = i > 1;
    const BootstrapReport report = bootstrapper.add(frame);
    if (!report.map) continue;
    EXPECT_GT(i, 1);
    EXPECT_TRUE(report.map->views.front().fixed.empty());
    return;
  }
  FAIL() << "no map";
}

TEST_F(TwoMotionsTest, ACameraThatStandsStillSeesNone) { EXPECT_FALSE(motions(frame(0), frame(0)).found); }

TEST_F(TwoMotionsTest, ACameraThatMovesSeesNone) {
  for (const double metres : {0.002, 0.01, 0.03, 0.1}) {
    for (const double turn : {0.0, 0.05 * kDegree, 0.5 * kDegree}) {
      const Frame first = frame(0);
      EXPECT_FALSE(motions(first, frame(0, camera_at({metres, 0, 0}, turn))).found) << metres << " " << turn;
      EXPECT_FALSE(motions(first, frame(0, camera_at({0, 0, 3 * metres}, turn))).found)
          << metres << " " << turn;
    }
  }
}

TEST_F(TwoMotionsTest, ThingsThatMoveEachItsOwnWayAreNoObject) {
  const Frame first = frame(0);
  for (Eigen::Vector3d& x : object_.x_in_map) {
    x += Eigen::Vector3d(random_.uniform(-0.2, 0.2), random_.uniform(-0.2, 0.2), 0);
  }
  EXPECT_FALSE(motions(first, frame(0)).found);
}

TEST_F(TwoMotionsTest, TheFeaturesOfTheObjectAreTheOnesNearIt) {
  const Frame first = frame(0), second = frame(3 * kDegree);
  const TwoMotions found = motions(first, second);
  std::vector<cv::Point2f> moved;
  for (const int f : found.moved_of_first) {
    moved.emplace_back(first.image->set.features[f].pixel.x(), first.image->set.features[f].pixel.y());
  }
  const std::vector<char> object = features_of_object(*first.image, moved, found.still);
  int right = 0;
  for (int i = 0; i < first.image->size(); ++i) right += (object[i] != 0) == (i >= wall_features_);
  EXPECT_GT(right, 0.8 * first.image->size());
}

// The map has the object's points only.
TEST_F(TwoMotionsTest, TheBootstrapMakesAMapOfTheObject) {
  Bootstrapper bootstrapper(TrackerOptions(), camera_);
  BootstrapReport report;
  for (int i = 0; i < 20 && !report.map; ++i) report = bootstrapper.add(frame(i * kDegree));
  ASSERT_TRUE(report.map) << report.text;
  EXPECT_GT(report.static_background.size(), 100u);
  EXPECT_GT(report.moved_px, 3);
  const InitialMap::View& last = report.map->views.back();
  const Rigid3 found = last.camera_from_map * report.map->views.front().camera_from_map.inverse();
  const double turned = static_cast<double>(last.frame.index - report.map->views.front().frame.index);
  EXPECT_NEAR(rotation_angle_between(found.rotation, Eigen::Quaterniond::Identity()) / kDegree, turned, 0.5);
}

TEST_F(TwoMotionsTest, WithoutSegmentationTheBootstrapSaysThatTheBackgroundStandsStill) {
  TrackerOptions options;
  options.segmentation.method = "none";
  Bootstrapper bootstrapper(options, camera_);
  BootstrapReport report;
  for (int i = 0; i < 12; ++i) report = bootstrapper.add(frame(i * kDegree));
  EXPECT_FALSE(report.map);
  EXPECT_EQ(report.reason, Reason::kStillBackground) << report.text;
}

TEST_F(TwoMotionsTest, ACameraThatStandsStillBeforeItMovesGetsItsMapOfEverything) {
  Bootstrapper bootstrapper(TrackerOptions(), camera_);
  BootstrapReport report;
  for (int i = 0; i < 40 && !report.map; ++i) {
    report = bootstrapper.add(frame(0, camera_at({0.02 * std::max(0, i - 10), 0, 0}, 0)));
  }
  ASSERT_TRUE(report.map) << report.text;
  EXPECT_TRUE(report.static_background.empty());
  EXPECT_GT(report.map->points.size(), 250u);
}

}  // namespace
}  // namespace mono_pose_tracker
