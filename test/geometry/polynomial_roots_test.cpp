#include "geometry/polynomial_roots.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/statistics.h"

namespace mono_pose_tracker {
namespace {

/// Multiplies a polynomial, ascending, by (z - root).
std::vector<double> times_root(const std::vector<double>& c, double root) {
  std::vector<double> product(c.size() + 1, 0.0);
  for (std::size_t i = 0; i < c.size(); ++i) {
    product[i + 1] += c[i];
    product[i] -= root * c[i];
  }
  return product;
}

/// Multiplies by (z - a)^2 + b^2, whose roots are complex.
std::vector<double> times_complex_pair(const std::vector<double>& c, double a, double b) {
  std::vector<double> product(c.size() + 2, 0.0);
  for (std::size_t i = 0; i < c.size(); ++i) {
    product[i] += (a * a + b * b) * c[i];
    product[i + 1] -= 2 * a * c[i];
    product[i + 2] += c[i];
  }
  return product;
}

std::vector<double> sorted_roots(const std::vector<double>& c) {
  ProjectiveRoot roots[10];
  const int count = real_roots_degree10(c.data(), roots);
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(roots[i].is_inverse ? 1 / roots[i].value : roots[i].value);
  std::sort(values.begin(), values.end());
  return values;
}

TEST(PolynomialRoots, QuadraticDoesNotCancel) {
  const double c[3] = {1, -1e8, 1};
  double roots[2];
  ASSERT_EQ(real_quadratic_roots(c, roots), 2);
  EXPECT_NEAR(roots[0], 1e-8, 1e-22);
  EXPECT_NEAR(roots[1], 1e8, 1e-6);
  const double complex_pair[3] = {1, 0, 1};
  EXPECT_EQ(real_quadratic_roots(complex_pair, roots), 0);
}

TEST(PolynomialRoots, CubicFindsOneOrThree) {
  Random random(1);
  for (int trial = 0; trial < 1000; ++trial) {
    std::vector<double> truth = {random.uniform(-3, -1), random.uniform(-0.5, 0.5), random.uniform(1, 3)};
    std::vector<double> c = {1};
    for (const double root : truth) c = times_root(c, root);
    const double three[4] = {c[3], c[2], c[1], c[0]};
    double roots[3];
    ASSERT_EQ(real_cubic_roots(three, roots), 3);
    std::sort(roots, roots + 3);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(roots[i], truth[i], 1e-12);

    c = times_complex_pair({-truth[0], 1}, truth[1], 0.3);
    const double one[4] = {c[3], c[2], c[1], c[0]};
    ASSERT_EQ(real_cubic_roots(one, roots), 1);
    EXPECT_NEAR(roots[0], truth[0], 1e-12);
  }
}

TEST(PolynomialRoots, DegreeTenFindsAllRealRootsOnTheWholeLine) {
  Random random(2);
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<double> truth;
    std::vector<double> c = {random.uniform(0.5, 2)};
    const int real_count = 2 * static_cast<int>(random.index(4));
    for (int i = 0; i < real_count; ++i) {
      // Apart by at least a tenth of a radian on the projective line, from end to end of it.
      truth.push_back(std::tan(-1.5 + 3.0 * (i + random.uniform(0.15, 0.85)) / real_count));
      c = times_root(c, truth.back());
    }
    while (c.size() < 11) c = times_complex_pair(c, random.uniform(-2, 2), random.uniform(0.3, 2));
    const std::vector<double> found = sorted_roots(c);
    ASSERT_EQ(found.size(), truth.size()) << trial;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      EXPECT_NEAR(found[i], truth[i], 1e-6 * (1 + truth[i] * truth[i])) << trial;
    }
  }
}

TEST(PolynomialRoots, DegreeTenReportsADoubleRootTwice) {
  std::vector<double> c = times_root(times_root({1}, 0.3), 0.3);
  while (c.size() < 11) c = times_complex_pair(c, 0.1 * static_cast<double>(c.size()), 1);
  const std::vector<double> found = sorted_roots(c);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR(found[0], 0.3, 1e-5);
  EXPECT_NEAR(found[1], 0.3, 1e-5);
}

TEST(PolynomialRoots, DegreeTenRefusesZeroAndNumbersThatAreNotFinite) {
  ProjectiveRoot roots[10];
  double c[11] = {};
  EXPECT_EQ(real_roots_degree10(c, roots), 0);
  c[0] = -1;
  c[10] = 1;
  EXPECT_EQ(real_roots_degree10(c, roots), 2);
  c[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(real_roots_degree10(c, roots), 0);
  c[3] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(real_roots_degree10(c, roots), 0);
}

}  // namespace
}  // namespace mono_pose_tracker
