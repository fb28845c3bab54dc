#include "robust/bearing_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>
#include <vector>

#include "geometry/essential.h"
#include "robust/two_view_scene.h"

namespace mono_pose_tracker {
namespace {

TEST(BearingPairs, ShufflesAndExcludesNonFinitePairs) {
  TwoViewScene scene = make_two_view_scene(TwoViewSceneOptions(), 1);
  scene.bearings1[10].x() = std::numeric_limits<double>::quiet_NaN();
  scene.bearings2[20].setZero();
  const BearingPairs pairs(scene.bearings1, scene.bearings2, 3);
  ASSERT_EQ(pairs.size(), 498);
  std::set<int> sources;
  int in_place = 0;
  for (int i = 0; i < pairs.size(); ++i) {
    sources.insert(pairs.source(i));
    in_place += pairs.source(i) == i;
    EXPECT_LT((pairs.first()[i] - scene.bearings1[pairs.source(i)]).norm(), 1e-15);
    EXPECT_LT((pairs.second()[i] - scene.bearings2[pairs.source(i)]).norm(), 1e-15);
  }
  EXPECT_EQ(sources.size(), 498u);
  EXPECT_EQ(sources.count(10) + sources.count(20), 0u);
  EXPECT_LT(in_place, 20);
}

// Under the reversed rotation of half the scenes many pairs are behind a camera, and some at the tolerance.
TEST(SquaredErrors, AgreeWithThePlainFormulas) {
  constexpr double kTolerance = 2 * kPixel;
  int in_front = 0, behind = 0;
  for (int seed = 0; seed < 20; ++seed) {
    const TwoViewScene scene = make_two_view_scene(TwoViewSceneOptions(), seed);
    const BearingPairs pairs(scene.bearings1, scene.bearings2, 0);
    TwoViewModel model = model_of(scene.second_from_first);
    if (seed % 2 == 1) model.rotation.transposeInPlace();
    const Eigen::Matrix3d essential = essential_matrix(Rigid3(model.rotation, model.translation));
    for (int begin = 0; begin < pairs.size(); begin += kBlockSize) {
      double squared[kBlockSize];
      squared_errors(PairBlock(pairs, begin), MotionRows(model), kTolerance, 1, squared);
      for (int i = begin; i < std::min(begin + kBlockSize, pairs.size()); ++i) {
        const Eigen::Vector3d x1 = pairs.first()[i], x2 = pairs.second()[i];
        const double error = sampson_error(essential, x1, x2);
        const bool front = may_be_in_front(model, x1, x2, kTolerance);
        EXPECT_NEAR(squared[i - begin], error * error + (front ? 0 : 1), 0.01 * error * error + 1e-15);
        ++(front ? in_front : behind);
      }
    }
  }
  EXPECT_GT(in_front, 1000);
  EXPECT_GT(behind, 1000);
}

TEST(ScoreTwoViews, AgreesWithThePlainFormula) {
  TwoViewSceneOptions options;
  options.num_points = 203;  // no multiple of four
  options.outlier_ratio = 0.3;
  const TwoViewScene scene = make_two_view_scene(options, 2);
  const BearingPairs pairs(scene.bearings1, scene.bearings2, 0);
  const Eigen::Matrix3d essential = essential_matrix(scene.second_from_first);
  const double threshold = 2 * kPixel;
  double cost = 0;
  int num_inliers = 0;
  for (int i = 0; i < 203; ++i) {
    const double error = sampson_error(essential, scene.bearings1[i], scene.bearings2[i]);
    const bool inlier = std::abs(error) < threshold &&
                        is_in_front(scene.second_from_first, scene.bearings1[i], scene.bearings2[i]);
    cost += inlier ? error * error : threshold * threshold;
    num_inliers += inlier;
  }
  std::vector<char> inliers;
  const RansacScore score =
      score_two_views(pairs, model_of(scene.second_from_first), threshold, kNoBound, &inliers);
  EXPECT_EQ(score.num_inliers, num_inliers);
  EXPECT_EQ(std::count(inliers.begin(), inliers.end(), 1), num_inliers);
  EXPECT_NEAR(score.cost, cost, 1e-3 * cost);
}

TEST(ScoreTwoViews, ThePoseBehindHasNoInliers) {
  const TwoViewScene scene = make_two_view_scene(TwoViewSceneOptions(), 3);
  const BearingPairs pairs(scene.bearings1, scene.bearings2, 0);
  TwoViewModel behind = model_of(scene.second_from_first);
  behind.translation = -behind.translation;
  EXPECT_EQ(score_two_views(pairs, behind, 2 * kPixel, kNoBound).num_inliers, 0);
}

TEST(ScoreTwoViews, GivesUpAtTheBound) {
  const TwoViewScene scene = make_two_view_scene(TwoViewSceneOptions(), 4);
  const BearingPairs pairs(scene.bearings1, scene.bearings2, 0);
  const TwoViewModel truth = model_of(scene.second_from_first);
  const RansacScore full = score_two_views(pairs, truth, 2 * kPixel, kNoBound);
  EXPECT_EQ(score_two_views(pairs, truth, 2 * kPixel, 1.1 * full.cost).cost, full.cost);
  EXPECT_EQ(score_two_views(pairs, truth, 2 * kPixel, 0.5 * full.cost).cost, kNoBound);
}

}  // namespace
}  // namespace mono_pose_tracker
