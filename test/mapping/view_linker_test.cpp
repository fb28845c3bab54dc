#include "mapping/view_linker.h"

#include <gtest/gtest.h>

#include <set>

#include "known_scene.h"
#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {
namespace {

constexpr int kViewsOfVisit = 3;  // of each visit

class ViewLinkerTest : public testing::Test {
 protected:
  // Keyframes of one visit to the place, and landmarks of its own, all off by the drift.
  void visit(int first_index, const Eigen::Vector3d& drift) {
    std::vector<KeyframeId> ids;
    for (int v = 0; v < kViewsOfVisit; ++v) {
      const Frame frame = scene_.frame(first_index + v, KnownScene::pose(v));
      const Rigid3 drift_from_map{Eigen::Quaterniond::Identity(), drift};
      ids.push_back(map_.add_keyframe(frame.index, frame.stamp_ns,
                                      KnownScene::pose(v) * drift_from_map.inverse(), frame.image));
    }
    for (std::size_t p = 0; p < scene_.scene.x_in_map.size(); ++p) {
      const LandmarkId l = map_.add_landmark(scene_.scene.x_in_map[p] + drift);
      int seen = 0;
      for (int v = 0; v < kViewsOfVisit; ++v) {
        const int feature = scene_.feature_of(first_index + v, static_cast<int>(p));
        if (feature >= 0) seen += map_.add_observation(l, ids[v], feature);
      }
      if (seen < 2) map_.remove_landmark(l);
    }
  }

  int link() { return link_views(TrackerOptions().mapper(scene_.camera.focal()), &map_); }

  // Whether a keyframe of the first visit shares landmarks with one of the second.
  bool tied() const {
    for (const auto& entry : map_.covisible(0)) {
      if (entry.first >= kViewsOfVisit) return true;
    }
    return false;
  }

  KnownScene scene_{250};
  Map map_;
};

TEST_F(ViewLinkerTest, TiesTwoVisitsOfOnePlace) {
  visit(0, Eigen::Vector3d::Zero());
  visit(100, {0.1, 0.05, -0.1});
  ASSERT_FALSE(tied());
  const std::size_t before = map_.landmarks().size();
  EXPECT_GT(link(), 0);
  map_.check();
  EXPECT_TRUE(tied());
  EXPECT_LT(map_.landmarks().size(), 0.6 * before) << "two landmarks of one point are one now";
  int wrong = 0;
  for (const auto& entry : map_.landmarks()) wrong += scene_.point_of_landmark(map_, entry.second) < 0;
  EXPECT_EQ(wrong, 0);
}

TEST_F(ViewLinkerTest, PosesAreLeftToTheBundleAdjustment) {
  visit(0, Eigen::Vector3d::Zero());
  visit(100, {0.1, 0.05, -0.1});
  const std::map<KeyframeId, Keyframe> before = map_.keyframes();
  ASSERT_GT(link(), 0);
  for (const auto& [id, keyframe] : map_.keyframes()) {
    EXPECT_EQ(keyframe.camera_from_map.translation, before.at(id).camera_from_map.translation);
  }
}

TEST_F(ViewLinkerTest, WhatIsTiedAlreadyIsLeftAlone) {
  visit(0, Eigen::Vector3d::Zero());
  EXPECT_EQ(link(), 0);
}

TEST_F(ViewLinkerTest, AnotherPlaceInTheSameDirectionIsNotTied) {
  visit(0, Eigen::Vector3d::Zero());
  for (int i = 0; i < scene_.scene.descriptors.rows; ++i) {
    for (int k = 0; k < 128; ++k) {
      scene_.scene.descriptors.at<std::uint8_t>(i, k) = static_cast<std::uint8_t>(scene_.random.index(80));
    }
  }
  visit(100, {0.1, 0.05, -0.1});
  EXPECT_EQ(link(), 0);
  EXPECT_FALSE(tied());
}

}  // namespace
}  // namespace mono_pose_tracker
