#include "mono_pose_tracker/features/matching.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "common/statistics.h"
#include "features/descriptor_distances.h"
#include "mono_pose_tracker/features/feature_grid.h"

namespace mono_pose_tracker {
namespace {

cv::Mat random_descriptors(int rows, std::uint64_t seed) {
  Random random(seed);
  cv::Mat m(rows, 128, CV_8U);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < 128; ++j) m.at<std::uint8_t>(i, j) = static_cast<std::uint8_t>(random.index(256));
  }
  return m;
}

TEST(Matching, DistanceIsTheSquaredEuclideanOne) {
  const cv::Mat m = random_descriptors(2, 1);
  int expected = 0;
  for (int j = 0; j < 128; ++j) {
    const int d = m.at<std::uint8_t>(0, j) - m.at<std::uint8_t>(1, j);
    expected += d * d;
  }
  EXPECT_EQ(descriptor_distance2(m.ptr(0), m.ptr(1)), expected);
}

// Sizes that fill no block, or several; descriptors at both ends of the range.
TEST(Matching, AllInstructionsGiveTheExactDistances) {
  for (const auto instructions :
       {DescriptorDistances::Instructions::kAny, DescriptorDistances::best_instructions()}) {
    for (const int rows : {1, 3, 4, 127, 130}) {
      cv::Mat first = random_descriptors(rows, 7), second = random_descriptors(2 * rows + 1, 8);
      first.row(0).setTo(255);
      second.row(0).setTo(0);
      if (rows > 1) first.row(1).setTo(0);
      DescriptorDistances distances(first, second, instructions);
      constexpr int kUntouched = 1'234'567'890;  // twice that is no int
      std::vector<int> found(DescriptorDistances::kBlock * DescriptorDistances::kRows, kUntouched);
      for (int begin = 0; begin < second.rows; begin += DescriptorDistances::kBlock) {
        const int count = distances.take_block(begin);
        ASSERT_EQ(count, std::min(DescriptorDistances::kBlock, second.rows - begin));
        for (int i = 0; i < rows; ++i) {
          const int r = i % DescriptorDistances::kRows;
          if (r == 0) {
            std::fill(found.begin(), found.end(), kUntouched);
            distances.find(i, found.data());
          }
          if (count <= DescriptorDistances::kBlock / 2) {
            ASSERT_EQ(found[DescriptorDistances::kBlock * (r + 1) - 1], kUntouched) << "not of this block";
          }
          for (int j = 0; j < count; ++j) {
            const double expected = cv::norm(first.row(i), second.row(begin + j), cv::NORM_L2SQR);
            ASSERT_EQ(found[DescriptorDistances::kBlock * r + j], expected)
                << rows << " " << i << " " << begin + j;
          }
        }
      }
    }
  }
}

// As many as make several blocks, every fourth a little like one of the other side.
TEST(Matching, FindsWhatLookingAtEachPairFinds) {
  const cv::Mat first = random_descriptors(301, 9);
  cv::Mat second = random_descriptors(517, 10);
  for (int i = 0; i < second.rows; i += 4) second.row(i) = 0.5 * second.row(i) + 0.5 * first.row(i % 301);
  std::vector<NearestTwo> of_first(first.rows), of_second(second.rows);
  for (int i = 0; i < first.rows; ++i) {
    for (int j = 0; j < second.rows; ++j) {
      const int d = descriptor_distance2(first.ptr(i), second.ptr(j));
      of_first[i].offer(j, d);
      of_second[j].offer(i, d);
    }
  }
  const std::vector<Match> matches = match_descriptors(first, second, MatchOptions());
  ASSERT_GT(matches.size(), 50u);
  auto match = matches.begin();
  for (int i = 0; i < first.rows; ++i) {
    const NearestTwo& n = of_first[i];
    if (of_second[n.index].index != i || 1.25 * 1.25 * n.best > n.second) continue;
    ASSERT_NE(match, matches.end());
    EXPECT_EQ(match->first, i);
    EXPECT_EQ(match->second, n.index);
    EXPECT_EQ(match->distance2, n.best);
    EXPECT_FLOAT_EQ(match->ratio, std::sqrt(static_cast<float>(n.best) / static_cast<float>(n.second)));
    ++match;
  }
  EXPECT_EQ(match, matches.end());
}

TEST(Matching, FindsTheShuffledCopies) {
  const cv::Mat first = random_descriptors(300, 2);
  cv::Mat second = random_descriptors(500, 3);
  for (int i = 0; i < 200; ++i) first.row(i).copyTo(second.row(499 - i));
  const std::vector<Match> matches = match_descriptors(first, second, MatchOptions());
  ASSERT_EQ(matches.size(), 200u);
  for (const Match& m : matches) EXPECT_EQ(m.second, 499 - m.first);
}

TEST(Matching, RefusesTheAmbiguous) {
  const cv::Mat first = random_descriptors(1, 4);
  cv::Mat second(2, 128, CV_8U);
  first.row(0).copyTo(second.row(0));
  first.row(0).copyTo(second.row(1));
  second.at<std::uint8_t>(0, 0) ^= 4;
  second.at<std::uint8_t>(1, 0) ^= 4;
  EXPECT_TRUE(match_descriptors(first, second, MatchOptions()).empty());
}

TEST(Matching, MutualKeepsEachRowOnce) {
  const cv::Mat one = random_descriptors(1, 5);
  cv::Mat first(2, 128, CV_8U);
  one.copyTo(first.row(0));
  one.copyTo(first.row(1));
  first.at<std::uint8_t>(1, 0) ^= 1;
  MatchOptions options;
  options.mutual = false;
  EXPECT_EQ(match_descriptors(first, one, options).size(), 2u);
  options.mutual = true;
  EXPECT_EQ(match_descriptors(first, one, options).size(), 1u);
}

TEST(Matching, EndsWhenItIsCancelled) {
  const cv::Mat m = random_descriptors(300, 5);
  std::atomic<bool> cancelled{false};
  MatchOptions options;
  options.cancelled = &cancelled;
  EXPECT_EQ(match_descriptors(m, m, options).size(), 300u);
  cancelled = true;
  EXPECT_TRUE(match_descriptors(m, m, options).empty());
}

TEST(Matching, NothingMatchesNothing) {
  EXPECT_TRUE(match_descriptors(cv::Mat(), random_descriptors(3, 6), MatchOptions()).empty());
  EXPECT_TRUE(match_descriptors(random_descriptors(3, 6), cv::Mat(), MatchOptions()).empty());
}

TEST(FeatureGrid, FindsJustTheFeaturesWithinTheRadius) {
  Random random(7);
  FeatureSet set;
  for (int i = 0; i < 500; ++i) {
    Feature f;
    f.pixel = {static_cast<float>(random.uniform(0, 640)), static_cast<float>(random.uniform(0, 480))};
    set.features.push_back(f);
  }
  const FeatureGrid grid(set, 640, 480);
  for (const double radius : {0.5, 10.0, 60.0, 900.0}) {
    const Eigen::Vector2d pixel(random.uniform(-20, 660), random.uniform(-20, 500));
    std::vector<char> found(set.size(), 0);
    grid.visit_near(pixel, radius, [&](int i) { ++found[i]; });
    for (int i = 0; i < set.size(); ++i) {
      const bool near = (set.features[i].pixel.cast<double>() - pixel).norm() <= radius;
      EXPECT_EQ(found[i], near ? 1 : 0);
    }
    EXPECT_EQ(grid.has_near(pixel, radius), std::count(found.begin(), found.end(), 1) > 0);
  }
}

}  // namespace
}  // namespace mono_pose_tracker
