#include "mapping/place_index.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <stdexcept>

#include "common/statistics.h"

namespace mono_pose_tracker {
namespace {

// Like SIFT descriptors: values that fall off quickly, length 512.
cv::Mat random_descriptor(Random& random) {
  cv::Mat row(1, 128, CV_8U);
  double values[128], sum2 = 0;
  for (double& v : values) {
    v = -std::log(1 - random.uniform());
    sum2 += v * v;
  }
  for (int k = 0; k < 128; ++k)
    row.at<std::uint8_t>(k) = cv::saturate_cast<std::uint8_t>(512 / std::sqrt(sum2) * values[k]);
  return row;
}

// The same patch in another view: at a distance of about 0.35 of the descriptor's length, as for matches of
// SIFT.
cv::Mat seen_again(const cv::Mat& descriptor, Random& random) {
  cv::Mat row = descriptor.clone();
  for (int k = 0; k < 128; ++k) {
    row.at<std::uint8_t>(k) = cv::saturate_cast<std::uint8_t>(row.at<std::uint8_t>(k) + 16 * random.normal());
  }
  return row;
}

DescriptorCode code_of(const DescriptorCoder& coder, const cv::Mat& descriptor, int num_uncertain) {
  return coder.encode({descriptor.ptr()}, num_uncertain).front();
}

FeatureSet feature_set(const std::vector<cv::Mat>& descriptors) {
  FeatureSet set;
  for (const cv::Mat& row : descriptors) {
    set.features.emplace_back();
    set.descriptors.push_back(row);
  }
  return set;
}

// A long street: keyframe k observes the points from 20 k to 20 k + 99, so neighbours have most points in
// common.
struct Street {
  static constexpr int kStep = 20, kSeen = 100;
  std::vector<cv::Mat> points;

  Street(int keyframes, Random& random) {
    while (static_cast<int>(points.size()) < kStep * keyframes + kSeen) {
      points.push_back(random_descriptor(random));
    }
  }
  FeatureSet view(int k, Random& random) const {
    std::vector<cv::Mat> seen;
    for (int i = 0; i < kSeen; ++i) seen.push_back(seen_again(points[kStep * k + i], random));
    return feature_set(seen);
  }
};

void expect_equal(const std::vector<PlaceMatch>& a, const std::vector<PlaceMatch>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].id, b[i].id);
    EXPECT_EQ(a[i].score, b[i].score);
  }
}

TEST(DescriptorCoder, SignaturesOfOnePatchAgreeAndOfOthersDoNot) {
  const DescriptorCoder coder;
  Random random(1);
  int same_word = 0, near = 0, near_by_chance = 0;
  for (int i = 0; i < 500; ++i) {
    const cv::Mat a = random_descriptor(random), b = seen_again(a, random), c = random_descriptor(random);
    const DescriptorCode code = code_of(coder, a, 0), again = code_of(coder, b, 0);
    same_word += code.word == again.word;
    near += __builtin_popcountll(code.signature ^ again.signature) <= 16;
    near_by_chance += __builtin_popcountll(code.signature ^ code_of(coder, c, 0).signature) <= 16;
  }
  EXPECT_GT(near, 450);
  EXPECT_LT(near_by_chance, 10);
  EXPECT_GT(same_word, 50);  // one in 65,536 by accident
}

// Several descriptors are encoded at once.
TEST(DescriptorCoder, ACodeDoesNotDependOnItsCompany) {
  Random random(3);
  const DescriptorCoder coder;
  std::vector<cv::Mat> rows;
  std::vector<const std::uint8_t*> descriptors;
  for (int i = 0; i < 19; ++i) {
    rows.push_back(random_descriptor(random));
    descriptors.push_back(rows.back().ptr());
  }
  const std::vector<DescriptorCode> codes = coder.encode(descriptors, 3);
  ASSERT_EQ(codes.size(), descriptors.size());
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const DescriptorCode alone = coder.encode({descriptors[i]}, 3).front();
    EXPECT_EQ(codes[i].word, alone.word);
    EXPECT_EQ(codes[i].signature, alone.signature);
    EXPECT_EQ(codes[i].uncertain, alone.uncertain);
  }
  EXPECT_TRUE(coder.encode({}, 3).empty());
}

TEST(DescriptorCoder, UncertainBitsAreThoseThatTurn) {
  const DescriptorCoder coder;
  Random random(2);
  int turned = 0, foreseen = 0;
  for (int i = 0; i < 500; ++i) {
    const cv::Mat a = random_descriptor(random);
    const DescriptorCode code = code_of(coder, a, 4);
    const int differing = code.word ^ code_of(coder, seen_again(a, random), 0).word;
    for (int bit = 0; bit < DescriptorCode::kWordBits; ++bit) turned += differing >> bit & 1;
    for (int n = 0; n < 4; ++n) foreseen += differing >> code.uncertain[n] & 1;
  }
  // Four bits of sixteen, but more than half of those that change.
  EXPECT_GT(2 * foreseen, turned);
}

TEST(PlaceIndex, FindsThePlaceAmongHundreds) {
  Random random(3);
  const Street street(300, random);
  PlaceIndex index;
  for (int k = 0; k < 300; ++k) index.add(k, street.view(k, random));
  EXPECT_EQ(index.size(), 300);
  for (int k = 10; k < 290; k += 20) {
    const std::vector<PlaceMatch> found = index.query(street.view(k, random), 5);
    ASSERT_EQ(found.size(), 5u);
    EXPECT_LE(std::abs(found[0].id - k), 2);
    for (const PlaceMatch& match : found)
      EXPECT_LE(std::abs(match.id - k), 4) << "a keyframe with other points";
  }
}

TEST(PlaceIndex, TheSameImageScoresOne) {
  Random random(4);
  const Street street(2, random);
  PlaceIndex index;
  const FeatureSet view = street.view(0, random);
  index.add(7, view);
  const std::vector<PlaceMatch> found = index.query(view, 1);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].id, 7);
  EXPECT_DOUBLE_EQ(found[0].score, 1);
}

// Every room has chairs: an image with sixty of them and forty books is of the room with the books, though
// others have more chairs.
TEST(PlaceIndex, RareFeaturesDecide) {
  Random random(5);
  std::vector<cv::Mat> chairs, books;
  for (int i = 0; i < 60; ++i) chairs.push_back(random_descriptor(random));
  for (int i = 0; i < 40; ++i) books.push_back(random_descriptor(random));
  const auto room = [&](int num_chairs, bool with_books) {
    std::vector<cv::Mat> seen;
    for (int i = 0; i < num_chairs; ++i) seen.push_back(seen_again(chairs[i], random));
    for (const cv::Mat& book : books)
      seen.push_back(with_books ? seen_again(book, random) : random_descriptor(random));
    return feature_set(seen);
  };
  PlaceIndex index;
  for (int k = 0; k < 60; ++k) index.add(k, room(60, false));
  index.add(60, room(40, true));
  const std::vector<PlaceMatch> found = index.query(room(60, true), 3);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].id, 60);
}

// Accidental matches, and structures at another place, have any rotation.
TEST(PlaceIndex, ACommonRotationDecides) {
  Random random(12);
  std::vector<cv::Mat> points;
  for (int i = 0; i < 500; ++i) points.push_back(random_descriptor(random));
  const auto turned = [&](FeatureSet set, const std::function<double(int)>& angle) {
    for (int i = 0; i < set.size(); ++i) {
      set.features[i].angle = static_cast<float>(std::fmod(angle(i), 2 * M_PI));
    }
    return set;
  };
  const auto view = [&](int num_seen) {
    std::vector<cv::Mat> seen;
    for (int i = 0; i < 500; ++i) {
      seen.push_back(i < num_seen ? seen_again(points[i], random) : random_descriptor(random));
    }
    return feature_set(seen);
  };
  const auto in_the_place = [](int i) { return 0.01 * i; };
  PlaceIndex index;
  index.add(0, turned(view(450), [&](int) { return random.uniform(0, 2 * M_PI); }));
  index.add(1, turned(view(300), in_the_place));
  for (const double turn : {0.0, 0.3, 1.5, 3.0, 6.2}) {
    const std::vector<PlaceMatch> found =
        index.query(turned(view(500), [&](int i) { return in_the_place(i) + turn; }), 2);
    ASSERT_FALSE(found.empty());
    EXPECT_EQ(found[0].id, 1) << "a camera turned by " << turn;
  }
}

TEST(PlaceIndex, AnswersDependOnTheSetOfKeyframesAlone) {
  Random random(6);
  const Street street(60, random);
  std::vector<FeatureSet> views;
  for (int k = 0; k < 60; ++k) views.push_back(street.view(k, random));
  PlaceIndex lived, rebuilt;
  for (int k = 59; k >= 0; --k) lived.add(k, views[k]);
  for (int k = 0; k < 60; k += 3) lived.remove(k);
  lived.add(30, views[30]);  // takes the place of one that went
  for (int k = 0; k < 60; ++k) {
    if (k % 3 != 0 || k == 30) rebuilt.add(k, views[k]);
  }
  EXPECT_EQ(lived.size(), rebuilt.size());
  for (int k = 0; k < 60; k += 7) {
    const FeatureSet query = street.view(k, random);
    expect_equal(lived.query(query, 10), rebuilt.query(query, 10));
  }
}

TEST(PlaceIndex, ARemovedKeyframeIsNotFound) {
  Random random(8);
  const Street street(20, random);
  PlaceIndex index;
  const std::size_t empty = index.memory_bytes();
  for (int k = 0; k < 20; ++k) index.add(k, street.view(k, random));
  EXPECT_GT(index.memory_bytes(), empty);
  EXPECT_TRUE(index.contains(10));
  index.remove(10);
  index.remove(10);
  EXPECT_FALSE(index.contains(10));
  EXPECT_EQ(index.size(), 19);
  for (const PlaceMatch& match : index.query(street.view(10, random), 20)) EXPECT_NE(match.id, 10);
  index.clear();
  EXPECT_EQ(index.size(), 0);
  EXPECT_TRUE(index.query(street.view(10, random), 20).empty());
}

// As in a capped map on an endless path: ten keyframes stay, and finally every word has had a feature.
TEST(PlaceIndex, WhatComesAndGoesLeavesNoMemoryBehind) {
  Random random(9);
  const Street street(400, random);
  PlaceIndex index;
  const std::size_t empty = index.memory_bytes();
  for (int k = 0; k < 10; ++k) index.add(k, street.view(k, random));
  const std::size_t ten = index.memory_bytes() - empty;
  for (int k = 10; k < 400; ++k) {
    index.add(k, street.view(k, random));
    index.remove(k - 10);
  }
  EXPECT_LT(index.memory_bytes() - empty, 2 * ten);
}

TEST(PlaceIndex, OnlyKeyframesThatAreAllowed) {
  Random random(9);
  const Street street(40, random);
  PlaceIndex index;
  for (int k = 0; k < 40; ++k) index.add(k, street.view(k, random));
  const auto found =
      index.query(street.view(20, random), 2, [](KeyframeId id) { return id < 17 || id > 22; });
  ASSERT_EQ(found.size(), 2u);
  for (const PlaceMatch& match : found) {
    EXPECT_TRUE(match.id == 16 || match.id == 23 || match.id == 24) << match.id;
  }
}

TEST(PlaceIndex, NothingIsFoundInNothing) {
  Random random(10);
  const Street street(2, random);
  PlaceIndex index;
  EXPECT_TRUE(index.query(street.view(0, random), 5).empty());
  index.add(0, FeatureSet());
  index.add(1, street.view(0, random));
  EXPECT_TRUE(index.query(FeatureSet(), 5).empty());
  EXPECT_TRUE(index.query(street.view(0, random), 0).empty());
  index.remove(0);
  EXPECT_EQ(index.size(), 1);
}

TEST(PlaceIndex, ManyFeaturesTheStrongestCount) {
  Random random(11);
  PlaceIndexOptions options;
  options.max_features = 50;
  PlaceIndex index(options);
  std::vector<cv::Mat> strong, weak;
  for (int i = 0; i < 50; ++i) strong.push_back(random_descriptor(random));
  for (int i = 0; i < 50; ++i) weak.push_back(random_descriptor(random));
  std::vector<cv::Mat> both = weak;
  both.insert(both.end(), strong.begin(), strong.end());
  FeatureSet set = feature_set(both);
  for (int i = 0; i < 100; ++i) set.features[i].response = i < 50 ? 0.1f : 0.2f;
  index.add(0, set);
  EXPECT_TRUE(index.query(feature_set(weak), 1).empty());
  EXPECT_EQ(index.query(feature_set(strong), 1).size(), 1u);
}

TEST(PlaceIndex, RefusesAKeyframeTwice) {
  PlaceIndex index;
  index.add(3, FeatureSet());
  EXPECT_THROW(index.add(3, FeatureSet()), std::invalid_argument);
}

}  // namespace
}  // namespace mono_pose_tracker
