#include "evaluation/relative_pose_choice.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "geometry/essential.h"
#include "simulation/solver_problems.h"

namespace mono_pose_tracker {
namespace {

/// Seven points without noise, the first five the sample.
ChoiceInput make_input(Random& random) {
  const auto problem = box_problem<7>(random, 1.0);
  ChoiceInput input;
  input.bearings1.assign(problem.bearings1.begin(), problem.bearings1.end());
  input.bearings2.assign(problem.bearings2.begin(), problem.bearings2.end());
  input.sample_size = 5;
  input.true_second_from_first = problem.second_from_first;
  return input;
}

TEST(RelativePoseChoice, ErrorsAreAnglesWhateverTheLengthOfTheTranslation) {
  const Rigid3 truth(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 1));
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()));
  const PoseError error = pose_error(Rigid3(turned, Eigen::Vector3d(0, 5, 5)), truth);
  EXPECT_NEAR(error.rotation_deg, 5.729577951, 1e-6);
  EXPECT_NEAR(error.translation_deg, 45, 1e-9);
}

TEST(RelativePoseChoice, EveryRuleFindsTheTruthAmongOthersWithoutNoise) {
  Random random(1);
  for (const Choice choice : {Choice::kCheirality, Choice::kSampson, Choice::kTruth}) {
    for (int trial = 0; trial < 50; ++trial) {
      const ChoiceInput input = make_input(random);
      const Rigid3 other(random_rotation(random), random_direction(random));
      Rigid3 chosen;
      ASSERT_TRUE(choose_pose({essential_matrix(other), essential_matrix(input.true_second_from_first)},
                              input, choice, &chosen));
      const PoseError error = pose_error(chosen, input.true_second_from_first);
      EXPECT_LT(error.rotation_deg, 1e-5);
      EXPECT_LT(error.translation_deg, 1e-5);
    }
  }
}

int sample_in_front(const Rigid3& pose, const ChoiceInput& input) {
  int count = 0;
  for (int i = 0; i < input.sample_size; ++i)
    count += is_in_front(pose, input.bearings1[i], input.bearings2[i]);
  return count;
}

TEST(RelativePoseChoice, CheiralityComesBeforeTheSampsonError) {
  Random random(2);
  int differ = 0;
  for (int trial = 0; trial < 200; ++trial) {
    ChoiceInput input = make_input(random);
    for (Eigen::Vector3d& b : input.bearings2) b = (b + 0.02 * random_direction(random)).normalized();
    std::vector<Eigen::Matrix3d> essentials;
    int most_in_front = 0;
    for (int i = 0; i < 4; ++i) {
      essentials.push_back(essential_matrix(Rigid3(random_rotation(random), random_direction(random))));
      std::array<Rigid3, 4> poses;
      ASSERT_TRUE(decompose_essential(essentials.back(), &poses));
      for (const Rigid3& pose : poses) most_in_front = std::max(most_in_front, sample_in_front(pose, input));
    }
    Rigid3 by_cheirality, by_sampson;
    ASSERT_TRUE(choose_pose(essentials, input, Choice::kCheirality, &by_cheirality));
    ASSERT_TRUE(choose_pose(essentials, input, Choice::kSampson, &by_sampson));
    EXPECT_EQ(sample_in_front(by_cheirality, input), most_in_front);
    differ += pose_error(by_cheirality, by_sampson).rotation_deg > 1;
  }
  EXPECT_GT(differ, 0);
}

TEST(RelativePoseChoice, NoSolutionsNoPose) {
  Random random(3);
  Rigid3 pose;
  EXPECT_FALSE(choose_pose({}, make_input(random), Choice::kCheirality, &pose));
  EXPECT_FALSE(choose_pose({Eigen::Matrix3d::Zero()}, make_input(random), Choice::kSampson, &pose));
}

TEST(RelativePoseChoice, NearestEssentialHasTwoEqualSingularValues) {
  Random random(4);
  Eigen::Matrix3d noise;
  for (int i = 0; i < 9; ++i) noise(i) = 1e-3 * random.normal();
  const Eigen::Matrix3d truth = essential_matrix(Rigid3(random_rotation(random), random_direction(random)));
  const Eigen::Matrix3d e = nearest_essential(5 * (truth + noise));
  EXPECT_LT(distance_up_to_sign(e, truth), 0.01);
  EXPECT_LT((e * e.transpose() * e - 0.5 * (e * e.transpose()).trace() * e).norm(), 1e-14);
}

}  // namespace
}  // namespace mono_pose_tracker
