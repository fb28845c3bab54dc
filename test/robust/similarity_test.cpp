#include "robust/similarity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/rotation.h"
#include "simulation/solver_problems.h"

namespace mono_pose_tracker {
namespace {

constexpr double kPixelAngle = 1.0 / 500;  // rad

SimilarityOptions options() {
  SimilarityOptions options;
  options.ransac.threshold = 3 * kPixelAngle;
  return options;
}

Sim3 random_similarity(Random& random) {
  return {std::exp(random.uniform(-2, 2)), random_rotation(random), 10 * random_direction(random)};
}

// Points 4 to 8 away from cameras on either side, one pair of cameras for every 20.
struct TwoMaps {
  Sim3 b_from_a;
  std::vector<SimilarityMatch> matches;
};

ObservedPoint seen(const Eigen::Vector3d& x, const Eigen::Vector3d& center, double noise, Random& random) {
  const Eigen::Vector3d ray = x - center;
  ObservedPoint point;
  point.center = center;
  point.bearing = (ray.normalized() + noise * random.normal() * random_direction(random)).normalized();
  // A map knows depth ten times less than direction.
  point.x = x + noise * ray.norm() * (random.normal() * random_direction(random)) +
            10 * noise * random.normal() * ray;
  return point;
}

TwoMaps two_maps(int count, double outliers, double noise, Random& random,
                 const Eigen::Vector3d& extent = {2, 2, 2}) {
  TwoMaps maps;
  maps.b_from_a = random_similarity(random);
  Eigen::Vector3d center_a, center_b;
  for (int i = 0; i < count; ++i) {
    if (i % 20 == 0) {
      center_a = {random.uniform(-1, 1), random.uniform(-1, 1), -6};
      center_b = {random.uniform(-1, 1), random.uniform(-1, 1), -6};
    }
    const auto point = [&] {
      return Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1))
          .cwiseProduct(extent)
          .eval();
    };
    const Eigen::Vector3d x = point();
    const Eigen::Vector3d other = i < outliers * count ? point() : x;
    ObservedPoint in_b = seen(other, center_b, noise, random);
    in_b.bearing = maps.b_from_a.rotation * in_b.bearing;
    in_b.center = maps.b_from_a * in_b.center;
    in_b.x = maps.b_from_a * in_b.x;
    maps.matches.push_back({seen(x, center_a, noise, random), in_b});
  }
  return maps;
}

// Each match as one ray, of either map in turn: no point is known in both.
std::vector<RayToPoint> rays_of(const TwoMaps& maps) {
  std::vector<RayToPoint> rays;
  for (std::size_t i = 0; i < maps.matches.size(); ++i) {
    const SimilarityMatch& m = maps.matches[i];
    const bool is_of_a = i % 2 == 0;
    const ObservedPoint &own = is_of_a ? m.in_a : m.in_b, &other = is_of_a ? m.in_b : m.in_a;
    rays.push_back({is_of_a, static_cast<int>(i / 20), own.center, own.bearing, other.x});
  }
  return rays;
}

void expect_near(const Sim3& found, const Sim3& truth, double tolerance) {
  EXPECT_NEAR(found.scale / truth.scale, 1, tolerance);
  EXPECT_LT(found.rotation.angularDistance(truth.rotation), tolerance);
  EXPECT_LT((found.translation - truth.translation).norm(), 10 * tolerance * (1 + truth.scale));
}

TEST(SimilarityFromRays, FindsTheTruthAmongOutliers) {
  Random random(2);
  for (int trial = 0; trial < 20; ++trial) {
    const TwoMaps maps = two_maps(200, 0.5, 0, random);
    const SimilarityReport report = estimate_similarity_from_rays(rays_of(maps), options());
    ASSERT_TRUE(report.success) << trial;
    expect_near(report.b_from_a, maps.b_from_a, 1e-6);
    EXPECT_GE(report.num_inliers, 100);
    EXPECT_LT(report.num_inliers, 120);
  }
}

TEST(SimilarityFromRays, NoiseOfAPixel) {
  Random random(3);
  for (int trial = 0; trial < 20; ++trial) {
    const TwoMaps maps = two_maps(200, 0.3, 0.5 * kPixelAngle, random);
    const SimilarityReport report = estimate_similarity_from_rays(rays_of(maps), options());
    ASSERT_TRUE(report.success) << trial;
    expect_near(report.b_from_a, maps.b_from_a, 0.02);
  }
}

// One camera determines its pose, but no scale between the maps.
TEST(SimilarityFromRays, OneCameraHasNoScale) {
  Random random(4);
  const TwoMaps maps = two_maps(20, 0, 0, random);
  std::vector<RayToPoint> rays;
  for (const RayToPoint& ray : rays_of(maps)) {
    if (ray.is_of_a) rays.push_back(ray);
  }
  EXPECT_FALSE(estimate_similarity_from_rays(rays, options()).success);
  EXPECT_FALSE(estimate_similarity_from_rays({}, options()).success);
}

// Two of eight cameras agree on a similarity, and each of the others on its own.
TEST(SimilarityFromRays, CamerasThatDisagreeGiveNone) {
  Random random(5);
  const TwoMaps maps = two_maps(40, 0, 0, random);
  std::vector<RayToPoint> rays;
  for (std::size_t i = 0; i < maps.matches.size(); ++i) {
    const SimilarityMatch& m = maps.matches[i];
    rays.push_back({true, static_cast<int>(i / 20), m.in_a.center, m.in_a.bearing, m.in_b.x});
  }
  EXPECT_TRUE(estimate_similarity_from_rays(rays, options()).success);
  for (int camera = 2; camera < 8; ++camera) {
    for (const SimilarityMatch& m : two_maps(20, 0, 0, random).matches)
      rays.push_back({true, camera, m.in_a.center, m.in_a.bearing, m.in_b.x});
  }
  EXPECT_FALSE(estimate_similarity_from_rays(rays, options()).success);
}

TEST(SimilarityFromRays, ErrorsAreAsStated) {
  Random random(2);
  int within = 0;
  const int trials = 30;
  for (int trial = 0; trial < trials; ++trial) {
    TwoMaps maps = two_maps(100, 0.3, 0, random);
    for (SimilarityMatch& m : maps.matches) {
      for (ObservedPoint* seen : {&m.in_a, &m.in_b})
        seen->bearing =
            (seen->bearing + 0.5 * kPixelAngle * random.normal() * random_direction(random)).normalized();
    }
    const SimilarityReport report = estimate_similarity_from_rays(rays_of(maps), options());
    ASSERT_TRUE(report.success) << trial;
    const double turn = report.b_from_a.rotation.angularDistance(maps.b_from_a.rotation) / kDegree;
    EXPECT_LT(turn, 1);
    within += turn < 3 * report.rotation_sigma_deg;
  }
  EXPECT_GE(within, trials * 9 / 10);
}

TEST(SimilarityFromRays, AScaleThatIsNotKnownWellEnoughIsNone) {
  Random random(3);
  const TwoMaps maps = two_maps(80, 0, 0.3 * kPixelAngle, random);
  const SimilarityReport report = estimate_similarity_from_rays(rays_of(maps), options());
  ASSERT_TRUE(report.success);
  SimilarityOptions stricter = options();
  stricter.max_scale_sigma = 0.9 * report.scale_sigma;
  EXPECT_FALSE(estimate_similarity_from_rays(rays_of(maps), stricter).success);
}

TEST(SimilarityFromRays, ThreeRaysOrNoneThatAgreeAreNoSuccess) {
  Random random(4);
  for (const int count : {1, 2, 3}) {
    const SimilarityReport report =
        estimate_similarity_from_rays(rays_of(two_maps(count, 0, 0, random)), options());
    EXPECT_FALSE(report.success);
    EXPECT_EQ(report.inliers.size(), static_cast<std::size_t>(count));
  }
  for (int trial = 0; trial < 10; ++trial)
    EXPECT_FALSE(estimate_similarity_from_rays(rays_of(two_maps(60, 1, 0, random)), options()).success);
}

TEST(SimilarityFromRays, AnInlierIsFiniteAndSeenBeforeTheCamera) {
  Random random(5);
  TwoMaps maps = two_maps(60, 0, 0, random);
  for (int i = 0; i < 10; ++i) maps.matches[i].in_a.bearing *= -1, maps.matches[i].in_b.bearing *= -1;
  std::vector<RayToPoint> rays = rays_of(maps);
  rays[10].x.x() = std::numeric_limits<double>::quiet_NaN();
  rays[11].bearing.setZero();
  const SimilarityReport report = estimate_similarity_from_rays(rays, options());
  EXPECT_TRUE(report.success);
  for (int i = 0; i < 60; ++i) EXPECT_EQ(report.inliers[i] != 0, i >= 12) << i;
}

TEST(SimilarityFromRays, TheSameSeedGivesTheSameBytes) {
  Random random(6);
  const std::vector<RayToPoint> rays = rays_of(two_maps(80, 0.5, 0.5 * kPixelAngle, random));
  const SimilarityReport first = estimate_similarity_from_rays(rays, options());
  const SimilarityReport second = estimate_similarity_from_rays(rays, options());
  EXPECT_EQ(first.b_from_a.scale, second.b_from_a.scale);
  EXPECT_EQ(first.b_from_a.translation, second.b_from_a.translation);
  EXPECT_EQ(first.inliers, second.inliers);
}

// A strip of a wall, observed from its left by one map and from its right by the other: the depth uncertainty
// along the viewing ray of one map is constrained by the other. A point may be observed more than once, with
// one common depth error.
TEST(SimilarityByDepths, DepthThatIsNotKnownIsSeenFromTheSide) {
  constexpr double kDepthSigma = 0.015, kAside = 0.85, kDistance = 2.4, kBetween = 0.2;
  constexpr int kTrials = 40;
  Random random(12);
  for (const int observations : {1, 2}) {
    int within = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      const Sim3 b_from_a = random_similarity(random);
      std::vector<SimilarityMatch> matches;
      for (int i = 0; i < 100; ++i) {
        const Eigen::Vector3d x(random.uniform(-0.3, 0.3), random.uniform(-0.25, 0.25),
                                random.uniform(0, 0.02));
        const auto as_seen_from = [&](double side) {
          const Eigen::Vector3d left(side, 0, -kDistance);
          const Eigen::Vector3d known = x + kDepthSigma * random.normal() * (x - left);
          std::vector<ObservedPoint> points;
          for (int k = 0; k < observations; ++k) {
            const Eigen::Vector3d center = left + Eigen::Vector3d(0, kBetween * k, 0), ray = x - center;
            const Eigen::Vector3d noise = 0.3 * kPixelAngle * random.normal() * random_direction(random);
            points.push_back({known, center, (ray.normalized() + noise).normalized(), kDepthSigma});
          }
          return points;
        };
        const std::vector<ObservedPoint> in_a = as_seen_from(-kAside), in_b = as_seen_from(kAside);
        for (int k = 0; k < observations; ++k) {
          const ObservedPoint& b = in_b[k];
          matches.push_back(
              {in_a[k], {b_from_a * b.x, b_from_a * b.center, b_from_a.rotation * b.bearing, b.depth_sigma}});
        }
      }
      std::vector<Eigen::Vector3d> points_in_a, points_in_b;
      for (const SimilarityMatch& m : matches) {
        points_in_a.push_back(m.in_a.x);
        points_in_b.push_back(m.in_b.x);
      }
      Sim3 start;
      ASSERT_TRUE(align_sim3(points_in_a, points_in_b, &start));
      const SimilarityReport report = refine_similarity_by_depths(matches, options(), start);
      ASSERT_TRUE(report.success) << trial;
      EXPECT_GE(report.num_inliers, 80 * observations);
      EXPECT_LT(report.rotation_sigma_deg, 2);
      const double turn = report.b_from_a.rotation.angularDistance(b_from_a.rotation) / kDegree;
      within += turn < 3 * report.rotation_sigma_deg;
    }
    EXPECT_GE(within, kTrials * 9 / 10) << observations;
  }
}

// What noise of depth makes a line wide by does not tell the turn about it; nor do a few points.
TEST(SimilarityByDepths, ALineAndAFewPointsLeaveTheTurnOpen) {
  Random random(6);
  const auto with_depths = [&](int count, const Eigen::Vector3d& extent) {
    TwoMaps maps = two_maps(count, 0, 0.3 * kPixelAngle, random, extent);
    for (SimilarityMatch& m : maps.matches) m.in_a.depth_sigma = m.in_b.depth_sigma = 0.01;
    return refine_similarity_by_depths(maps.matches, options(), maps.b_from_a).success;
  };
  for (int trial = 0; trial < 10; ++trial) {
    EXPECT_FALSE(with_depths(80, {2, 0, 0}));
    EXPECT_FALSE(with_depths(80, {2, 1e-3, 1e-3}));
    EXPECT_FALSE(with_depths(7, {2, 2, 2}));
    EXPECT_TRUE(with_depths(80, {2, 2, 2}));
  }
}

TEST(SimilarityByDepths, NonFiniteMatchesAreExcluded) {
  Random random(7);
  TwoMaps maps = two_maps(60, 0, 0.3 * kPixelAngle, random);
  for (SimilarityMatch& m : maps.matches) m.in_a.depth_sigma = m.in_b.depth_sigma = 0.01;
  maps.matches[3].in_a.x.x() = std::numeric_limits<double>::quiet_NaN();
  maps.matches[4].in_b.x = maps.matches[4].in_b.center;
  const SimilarityReport report = refine_similarity_by_depths(maps.matches, options(), maps.b_from_a);
  ASSERT_TRUE(report.success);
  EXPECT_FALSE(report.inliers[3] || report.inliers[4]);
  EXPECT_GE(report.num_inliers, 50);
  EXPECT_FALSE(refine_similarity_by_depths({}, options(), maps.b_from_a).success);
}

// A map that is blown up without end shows nothing where it is seen, whatever of its depth is not known.
TEST(SimilarityByDepths, WhatIsNotKnownOfDepthDoesNotOutgrowIt) {
  Random random(5);
  TwoMaps maps = two_maps(120, 0.75, 0.3 * kPixelAngle, random);
  for (SimilarityMatch& m : maps.matches) m.in_a.depth_sigma = m.in_b.depth_sigma = 0.05;
  Sim3 blown_up = maps.b_from_a;
  blown_up.scale *= 1e4;
  const SimilarityReport right = refine_similarity_by_depths(maps.matches, options(), maps.b_from_a);
  ASSERT_TRUE(right.success);
  EXPECT_GE(right.num_inliers, 27);
  EXPECT_LT(right.score, 0.9 * refine_similarity_by_depths(maps.matches, options(), blown_up).score);
}

TEST(SimilarityFromRays, OptionsOutOfRangeAreRefused) {
  SimilarityOptions bad = options();
  bad.max_rotation_sigma_deg = 0;
  EXPECT_THROW(estimate_similarity_from_rays({}, bad), std::invalid_argument);
  bad = options();
  bad.max_scale_sigma = 0;
  EXPECT_THROW(estimate_similarity_from_rays({}, bad), std::invalid_argument);
  bad = options();
  bad.ransac.threshold = -1;
  EXPECT_THROW(estimate_similarity_from_rays({}, bad), std::invalid_argument);
}

}  // namespace
}  // namespace mono_pose_tracker
