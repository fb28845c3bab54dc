#include "mapping/epipolar_matcher.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/statistics.h"

namespace mono_pose_tracker {
namespace {

constexpr double kLeast = -0.004, kMost = 0.02;

Eigen::Vector3d random_direction(Random& random) {
  return Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

// Features within `spread` of a direction; one in ten is anywhere.
ImageFeatures image_of(int features, const Eigen::Vector3d& towards, double spread, Random& random) {
  ImageFeatures image;
  for (int i = 0; i < features; ++i) {
    const bool anywhere = i % 10 == 0;
    const Eigen::Vector3d bearing =
        anywhere ? random_direction(random) : (towards + spread * random_direction(random)).normalized();
    image.set.bearings.push_back(bearing);
  }
  return image;
}

// Features at the limit may be found or not.
void expect_what_comparing_all_finds(const ImageFeatures& image, const std::vector<int>& features,
                                     const Eigen::Vector3d& epipole, Random& random) {
  const EpipolarFan fan(image, epipole, features, kLeast, kMost);
  ASSERT_TRUE(
      std::is_permutation(features.begin(), features.end(), fan.features().begin(), fan.features().end()));
  constexpr double kRounding = 1e-6;
  std::vector<EpipolarFan::NearPlane> near;
  for (int plane = 0; plane < 100; ++plane) {
    const Eigen::Vector3d normal = epipole.cross(random_direction(random)).normalized();
    fan.find_near(normal, &near);
    std::set<int> found;
    for (const auto& [index, distance] : near) {
      EXPECT_TRUE(found.insert(fan.features()[index]).second) << "twice";
      EXPECT_NEAR(distance, normal.dot(image.set.bearings[fan.features()[index]]), kRounding);
      EXPECT_GT(distance, kLeast - kRounding);
      EXPECT_LT(distance, kMost + kRounding);
    }
    for (const int f : features) {
      const double distance = normal.dot(image.set.bearings[f]);
      if (distance > kLeast + kRounding && distance < kMost - kRounding) {
        EXPECT_EQ(found.count(f), 1u) << distance;
      }
    }
  }
}

TEST(EpipolarFan, FindsWhatComparingAllFinds) {
  Random random(1);
  for (const int size : {0, 1, 15, 16, 17, 500, 3000}) {
    for (const double spread : {0.01, 0.3, 2.0}) {
      const Eigen::Vector3d towards = random_direction(random);
      const ImageFeatures image = image_of(size, towards, spread, random);
      std::vector<int> features;
      for (int f = 0; f < size; ++f) {
        if (f % 3 != 1) features.push_back(f);
      }
      // Epipoles outside the view, in it and behind it, with any length.
      for (const Eigen::Vector3d& epipole :
           {Eigen::Vector3d(0.2 * towards.unitOrthogonal()), Eigen::Vector3d(3 * towards),
            Eigen::Vector3d(-towards + 0.1 * towards.unitOrthogonal())}) {
        expect_what_comparing_all_finds(image, features, epipole, random);
      }
    }
  }
}

// The camera moves straight ahead, and many features are where the angle around the epipole wraps.
TEST(EpipolarFan, NoneIsMissedWhereTheAngleJumps) {
  Random random(2);
  const Eigen::Vector3d epipole = Eigen::Vector3d::UnitZ();
  ImageFeatures image = image_of(500, epipole, 0.5, random);
  std::vector<int> features;
  for (const double sign : {-1.0, 1.0}) {
    for (int i = 0; i < 40; ++i) {
      const double a = sign * (0.3 + 0.01 * i);
      image.set.bearings.emplace_back(0, std::sin(a), std::cos(a));
      image.set.bearings.emplace_back(std::sin(a), 0, std::cos(a));
    }
  }
  for (std::size_t f = 0; f < image.set.bearings.size(); ++f) features.push_back(static_cast<int>(f));
  expect_what_comparing_all_finds(image, features, epipole, random);
}

}  // namespace
}  // namespace mono_pose_tracker
