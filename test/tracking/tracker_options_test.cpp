#include "mono_pose_tracker/tracking/tracker.h"

#include <gtest/gtest.h>

#include "support/expect_error.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

TEST(TrackerOptions, TooFewKeyframesForAMapAreNamed) {
  TrackerOptions options;
  options.mapping.max_keyframes = 3;
  expect_error<std::invalid_argument>([&] { options.validate(); }, {"mapping/max_keyframes = 3"});
}

TEST(TrackerOptions, OptionsOutOfRangeAreNamed) {
  TrackerOptions options;
  options.confidence = 2;
  expect_error<std::invalid_argument>([&] { Tracker(options, plain_camera(), Tracker::Mapping::kInline); },
                                      {"confidence", "2"});
}

}  // namespace
}  // namespace mono_pose_tracker
