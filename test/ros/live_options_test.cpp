#include "ros/live_options.h"

#include <dynamic_reconfigure/config_tools.h>
#include <gtest/gtest.h>

#include <cmath>

namespace mono_pose_tracker {
namespace {

using dynamic_reconfigure::ConfigTools;

// What a user is offered is the one table: every changeable key, with its default and its range.
TEST(LiveOptions, TheDescriptionIsTheTable) {
  const dynamic_reconfigure::ConfigDescription description = LiveOptions::__getDescriptionMessage__();
  ASSERT_EQ(description.groups.size(), 1u);
  TrackerOptions options;
  std::size_t changeable = 0;
  for (const OptionEntry& entry : option_table(&options)) {
    if (!entry.changeable) continue;
    ++changeable;
    if (const auto value = std::get_if<int*>(&entry.value)) {
      int least = -1, most = -1, standard = -1;
      ASSERT_TRUE(ConfigTools::getParameter(description.min, entry.key, least)) << entry.key;
      ASSERT_TRUE(ConfigTools::getParameter(description.max, entry.key, most)) << entry.key;
      ASSERT_TRUE(ConfigTools::getParameter(description.dflt, entry.key, standard)) << entry.key;
      EXPECT_EQ(least, static_cast<int>(entry.min)) << entry.key;
      EXPECT_EQ(most, static_cast<int>(entry.max)) << entry.key;
      EXPECT_EQ(standard, **value) << entry.key;
    } else if (const auto truth = std::get_if<bool*>(&entry.value)) {
      bool least = true, most = false, standard = !**truth;
      ASSERT_TRUE(ConfigTools::getParameter(description.min, entry.key, least)) << entry.key;
      ASSERT_TRUE(ConfigTools::getParameter(description.max, entry.key, most)) << entry.key;
      ASSERT_TRUE(ConfigTools::getParameter(description.dflt, entry.key, standard)) << entry.key;
      EXPECT_TRUE(!least && most) << entry.key;
      EXPECT_EQ(standard, **truth) << entry.key;
    } else {
      const auto number = std::get_if<double*>(&entry.value);
      double least = -1, most = -1, standard = -1;
      ASSERT_TRUE(ConfigTools::getParameter(description.min, entry.key, least)) << entry.key;
      ASSERT_TRUE(ConfigTools::getParameter(description.max, entry.key, most)) << entry.key;
      ASSERT_TRUE(ConfigTools::getParameter(description.dflt, entry.key, standard)) << entry.key;
      EXPECT_FLOAT_EQ(least, entry.min) << entry.key;
      EXPECT_FLOAT_EQ(most, entry.max) << entry.key;
      EXPECT_TRUE(number == nullptr || standard == **number) << entry.key;
    }
  }
  EXPECT_EQ(description.groups[0].parameters.size(), changeable + 1);  // and publish_period
}

TEST(LiveOptions, SurviveATripThroughAMessage) {
  LiveOptions sent, received;
  sent.publish_period = 2.5;
  sent.tracker.sift.max_features = 321;
  sent.tracker.mapping.keyframe_overlap = 0.25;
  dynamic_reconfigure::Config message;
  sent.__toMessage__(message);
  received.__fromMessage__(message);
  EXPECT_EQ(received.changes_since(sent), "");
  EXPECT_EQ(received.tracker.sift.max_features, 321);
  EXPECT_NE(received.changes_since(LiveOptions()).find("sift/max_features: 321"), std::string::npos);
}

// std::clamp leaves NaN as it is; on the parameter server it would keep the node from starting again.
TEST(LiveOptions, WhatIsNoNumberChangesNothing) {
  dynamic_reconfigure::Config message;
  ConfigTools::appendParameter(message, std::string("publish_period"), std::nan(""));
  ConfigTools::appendParameter(message, std::string("mapping/keyframe_overlap"), std::nan(""));
  ConfigTools::appendParameter(message, std::string("mapping/keyframe_found"), 0.5);
  LiveOptions options;
  options.__fromMessage__(message);
  options.__clamp__();
  EXPECT_EQ(options.changes_since(LiveOptions()), "mapping/keyframe_found: 0.5");
}

TEST(LiveOptions, AreClampedToTheirRanges) {
  LiveOptions options;
  options.tracker.sift.max_features = -4;
  options.tracker.mapping.keyframe_overlap = 3;
  options.__clamp__();
  EXPECT_EQ(options.tracker.sift.max_features, 0);
  EXPECT_EQ(options.tracker.mapping.keyframe_overlap, 1);
}

}  // namespace
}  // namespace mono_pose_tracker
