#include "tracking/frame_registrar.h"

#include <gtest/gtest.h>

#include <algorithm>

#include <Eigen/Eigenvalues>

#include "common/rotation.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr double kRegistrarNoise = 0.5;  // px, of a SIFT feature

// A map with one keyframe at the origin in which every point of the scene is a landmark.
TrackingMap map_of(const SyntheticScene& scene, const CameraModel& camera, Random& random) {
  std::vector<int> point_of;
  const Frame frame = synthetic_frame(scene, camera, Rigid3(), 0, 0, random, &point_of);
  TrackingMap map;
  KeyframeView keyframe;
  keyframe.id = 0;
  keyframe.image = frame.image;
  keyframe.landmark_of_feature = point_of;
  for (const int i : point_of) map.landmarks.set(i, scene.x_in_map[i]);
  map.keyframes.set(0, keyframe);
  return map;
}

class FrameRegistrarTest : public testing::Test {
 protected:
  void expect_right(const RegistrationReport& report, const Rigid3& camera_from_map) {
    ASSERT_TRUE(report.success) << report.text;
    EXPECT_EQ(report.reason, Reason::kOk);
    // 0.5 px of 600 are 0.05 degrees for one feature; about a hundred are more accurate.
    EXPECT_LT(rotation_angle_between(report.camera_from_map.rotation, camera_from_map.rotation),
              0.05 * kDegree);
    const Eigen::Vector3d offset =
        report.camera_from_map.inverse().translation - camera_from_map.inverse().translation;
    EXPECT_LT(offset.norm(), 0.005);
    EXPECT_GT(report.inliers, 0.9 * report.matches);
    EXPECT_EQ(report.inliers, static_cast<int>(report.observations.size()));
    EXPECT_NEAR(report.rms_px, kRegistrarNoise * std::sqrt(2), 0.15);
  }

  Random random_{3};
  CameraModel camera_ = synthetic_camera();
  SyntheticScene scene_ = box_scene(300, random_);
  TrackingMap map_ = map_of(scene_, camera_, random_);
  FrameRegistrar registrar_{TrackerOptions(), camera_};
  const Rigid3 truth_ = camera_at({0.4, -0.1, 0.3}, 5 * kDegree);
};

TEST_F(FrameRegistrarTest, DescriptorsAloneGiveThePose) {
  const Frame frame = synthetic_frame(scene_, camera_, truth_, kRegistrarNoise, 7, random_);
  expect_right(registrar_.register_frame(frame, map_, 0, std::nullopt), truth_);
}

// Scales all features, and their expected error with them.
ImageFeaturesPtr coarser(const ImageFeatures& image, float factor, const CameraModel& camera) {
  std::vector<Feature> features = image.set.features;
  for (Feature& feature : features) feature.scale *= factor;
  return restore_image_features({std::move(features), image.set.descriptors, {}}, image.color_rgb, camera);
}

TEST_F(FrameRegistrarTest, TheErrorIsToldInPixelsWhateverTheFeaturesScale) {
  constexpr float kFactor = 4;
  constexpr double kNoise = 1;  // px
  KeyframeView keyframe = map_.keyframes.at(0);
  keyframe.image = coarser(*keyframe.image, kFactor, camera_);
  map_.keyframes.set(0, keyframe);
  Frame frame = synthetic_frame(scene_, camera_, truth_, kNoise, 7, random_);
  frame.image = coarser(*frame.image, kFactor, camera_);
  const RegistrationReport report = registrar_.register_frame(frame, map_, 0, std::nullopt);
  ASSERT_TRUE(report.success) << report.text;
  EXPECT_NEAR(report.rms_px, kNoise * std::sqrt(2), 0.2);
}

TEST_F(FrameRegistrarTest, PredictionGuidesTheMatching) {
  const Frame frame = synthetic_frame(scene_, camera_, truth_, kRegistrarNoise, 7, random_);
  const Rigid3 predicted = camera_at({0.39, -0.11, 0.3}, 5.4 * kDegree);
  const RegistrationReport report = registrar_.register_frame(frame, map_, 0, predicted);
  expect_right(report, truth_);
  EXPECT_TRUE(report.is_where_predicted);
}

TEST_F(FrameRegistrarTest, PredictionFarOffIsOvercome) {
  const Frame frame = synthetic_frame(scene_, camera_, truth_, kRegistrarNoise, 7, random_);
  const RegistrationReport report =
      registrar_.register_frame(frame, map_, 0, camera_at({-2, 1, -3}, -40 * kDegree));
  expect_right(report, truth_);
  EXPECT_FALSE(report.is_where_predicted);
}

TEST_F(FrameRegistrarTest, ObservationsNameTheLandmarksSeen) {
  std::vector<int> point_of;
  const Frame frame = synthetic_frame(scene_, camera_, truth_, kRegistrarNoise, 7, random_, &point_of);
  const RegistrationReport report = registrar_.register_frame(frame, map_, 0, std::nullopt);
  ASSERT_GT(report.observations.size(), 100u);
  for (const FrameObservation& o : report.observations) EXPECT_EQ(o.landmark, point_of[o.feature]);
}

TEST_F(FrameRegistrarTest, OutliersAreExcluded) {
  // A third of the landmarks have moved.
  for (const auto& [id, x_in_map] : LandmarkPositions(map_.landmarks)) {
    const Eigen::Vector3d shift(random_.normal(), random_.normal(), random_.normal());
    if (id % 3 == 0) map_.landmarks.set(id, x_in_map + 0.5 * shift);
  }
  const Frame frame = synthetic_frame(scene_, camera_, truth_, kRegistrarNoise, 7, random_);
  const RegistrationReport report = registrar_.register_frame(frame, map_, 0, std::nullopt);
  ASSERT_TRUE(report.success) << report.text;
  EXPECT_LT(rotation_angle_between(report.camera_from_map.rotation, truth_.rotation), 0.1 * kDegree);
  int moved = 0;
  for (const FrameObservation& o : report.observations) moved += o.landmark % 3 == 0;
  EXPECT_LT(moved, 0.05 * report.observations.size());
}

TEST_F(FrameRegistrarTest, CovarianceTellsTheSpreadOfTheErrors) {
  // Squared errors normalised by a right covariance have mean 6, the number of unknowns.
  double sum = 0;
  constexpr int kTrials = 60;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Frame frame = synthetic_frame(scene_, camera_, truth_, kRegistrarNoise, trial, random_);
    const RegistrationReport report = registrar_.register_frame(frame, map_, 0, truth_);
    ASSERT_TRUE(report.success) << report.text;
    const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(report.covariance);
    ASSERT_GT(eigen.eigenvalues().minCoeff(), 0);
    ASSERT_LT((report.covariance - report.covariance.transpose()).norm(), 1e-9 * report.covariance.norm());
    const Rigid3 found = report.camera_from_map.inverse(), truth = truth_.inverse();
    const Eigen::AngleAxisd turn(found.rotation * truth.rotation.conjugate());
    Eigen::Matrix<double, 6, 1> error;
    error << found.translation - truth.translation, turn.angle() * turn.axis();
    sum += error.dot(report.covariance.ldlt().solve(error));
  }
  EXPECT_NEAR(sum / kTrials, 6, 2);  // four standard deviations of the mean of 60
}

TEST_F(FrameRegistrarTest, TooFewMatchesAreCounted) {
  const SyntheticScene other = box_scene(300, random_);
  const Frame frame = synthetic_frame(other, camera_, truth_, kRegistrarNoise, 7, random_);
  for (const std::optional<Rigid3>& predicted : {std::optional<Rigid3>(), std::optional<Rigid3>(truth_)}) {
    const RegistrationReport report = registrar_.register_frame(frame, map_, 0, predicted);
    EXPECT_FALSE(report.success);
    EXPECT_EQ(report.reason, Reason::kTooFewMatches);
    EXPECT_NE(report.text.find(" 15 needed"), std::string::npos) << report.text;
  }
}

TEST_F(FrameRegistrarTest, MatchesWithoutAPoseAreTooFewInliers) {
  for (const auto& entry : LandmarkPositions(map_.landmarks)) {
    map_.landmarks.set(entry.first,
                       {random_.uniform(-1.6, 1.6), random_.uniform(-1.2, 1.2), random_.uniform(3, 6)});
  }
  const Frame frame = synthetic_frame(scene_, camera_, truth_, kRegistrarNoise, 7, random_);
  const RegistrationReport report = registrar_.register_frame(frame, map_, 0, std::nullopt);
  EXPECT_FALSE(report.success);
  EXPECT_EQ(report.reason, Reason::kTooFewInliers) << report.text;
}

// A place finder that returns the newest keyframes first.
class NewestFirst : public PlaceFinder {
 public:
  explicit NewestFirst(const TrackingMap& map) {
    for (const auto& entry : map.keyframes) ids_.insert(ids_.begin(), entry.first);
  }
  std::vector<KeyframeId> find(const FeatureSet&, int count) const override {
    return {ids_.begin(), ids_.begin() + std::min<std::size_t>(ids_.size(), count)};
  }

 private:
  std::vector<KeyframeId> ids_;
};

TEST_F(FrameRegistrarTest, RelocalisationLooksWhereTheIndexSays) {
  // Twelve newer keyframes of other places before the right one.
  const KeyframeView good = map_.keyframes.at(0);
  for (int id = 1; id <= 12; ++id) {
    KeyframeView elsewhere = good;
    elsewhere.id = id;
    elsewhere.image = synthetic_frame(box_scene(100, random_), camera_, Rigid3(), 0, id, random_).image;
    elsewhere.landmark_of_feature.assign(elsewhere.image->size(), kNoLandmark);
    map_.keyframes.set(id, elsewhere);
  }
  const Frame frame = synthetic_frame(scene_, camera_, truth_, kRegistrarNoise, 20, random_);
  map_.places = std::make_shared<NewestFirst>(map_);
  EXPECT_FALSE(registrar_.relocalize(frame, map_, 8).success);
  expect_right(registrar_.relocalize(frame, map_, 13), truth_);
}

constexpr int kOtherPlace = 10000;  // first id of its landmarks

// Adds another door of a row, so far from the first in the map that neither is in the view of the other, with
// `steps` keyframes between them.
void add_same_place_at_offset(double offset, int steps, TrackingMap* map) {
  const KeyframeView first = map->keyframes.at(0);
  for (const auto& [id, x_in_map] : LandmarkPositions(map->landmarks)) {
    map->landmarks.set(id + kOtherPlace, x_in_map + Eigen::Vector3d(offset, 0, 0));
  }
  for (int step = 1; step <= steps; ++step) {
    KeyframeView keyframe = first;
    keyframe.id = keyframe.frame_index = step;
    const bool is_last = step == steps;
    // Back and forth, for any length of path.
    const double along = is_last ? offset : (step % 2 == 0 ? 0 : 1);
    keyframe.camera_from_map = camera_at({along, 0, 0}, 0);
    for (LandmarkId& l : keyframe.landmark_of_feature) l = is_last ? l + kOtherPlace : kNoLandmark;
    map->keyframes.set(step, keyframe);
  }
  map->places = std::make_shared<NewestFirst>(*map);
}

TEST_F(FrameRegistrarTest, OfTwoPlacesThatFitEquallyNeitherIsTaken) {
  add_same_place_at_offset(20, 1, &map_);
  const Frame frame = synthetic_frame(scene_, camera_, truth_, kRegistrarNoise, 20, random_);
  const RegistrationReport report = registrar_.relocalize(frame, map_, 8);
  EXPECT_FALSE(report.success);
  EXPECT_EQ(report.reason, Reason::kAmbiguousPose) << report.text;
}

// For any path length between them: a heading does not drift by a right angle.
TEST_F(FrameRegistrarTest, TwoSimilarWallsOfARoomAreAmbiguous) {
  add_same_place_at_offset(0, 20, &map_);
  const Eigen::AngleAxisd quarter(90 * kDegree, Eigen::Vector3d::UnitY());
  for (const auto& [id, x_in_map] : LandmarkPositions(map_.landmarks)) {
    if (id >= kOtherPlace) map_.landmarks.set(id, quarter * x_in_map);
  }
  KeyframeView last = map_.keyframes.at(20);
  last.camera_from_map = Rigid3(quarter.toRotationMatrix().transpose(), Eigen::Vector3d::Zero());
  map_.keyframes.set(20, last);
  const Frame frame = synthetic_frame(scene_, camera_, truth_, kRegistrarNoise, 20, random_);
  EXPECT_EQ(registrar_.relocalize(frame, map_, 30).reason, Reason::kAmbiguousPose);
}

// A long loop, at the end of which the map has drifted by a tenth of its length.
TEST_F(FrameRegistrarTest, ADriftedCopyIsNotAmbiguous) {
  add_same_place_at_offset(2, 20, &map_);
  const Frame frame = synthetic_frame(scene_, camera_, truth_, kRegistrarNoise, 20, random_);
  EXPECT_TRUE(registrar_.relocalize(frame, map_, 30).success);
}

TEST_F(FrameRegistrarTest, WhatLeavesMostOfTheViewUnexplainedIsNoRelocalisation) {
  // The frame shows a copy of a ninth of the scene: one similar window with other surroundings.
  std::vector<Eigen::Vector3d> points;
  cv::Mat descriptors;
  for (std::size_t i = 0; i < scene_.x_in_map.size(); ++i) {
    const Eigen::Vector3d& x = scene_.x_in_map[i];
    if (std::abs(x.x()) > 0.53 || std::abs(x.y()) > 0.4) continue;
    points.push_back(x);
    descriptors.push_back(scene_.descriptors.row(static_cast<int>(i)));
  }
  SyntheticScene corner = box_scene(static_cast<int>(scene_.x_in_map.size()), random_);
  for (std::size_t i = 0; i < points.size(); ++i) {
    corner.x_in_map[i] = points[i];
    descriptors.row(static_cast<int>(i)).copyTo(corner.descriptors.row(static_cast<int>(i)));
  }
  const Frame frame = synthetic_frame(corner, camera_, Rigid3(), kRegistrarNoise, 20, random_);
  map_.places = std::make_shared<NewestFirst>(map_);
  const RegistrationReport report = registrar_.relocalize(frame, map_, 8);
  EXPECT_GE(report.inliers, TrackerOptions().resection.min_inliers) << "enough to look right";
  EXPECT_FALSE(report.success) << report.support.found << " of " << report.support.in_map.expected << ", "
                               << report.support.spread;
}

}  // namespace
}  // namespace mono_pose_tracker
