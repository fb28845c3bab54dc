#include <gtest/gtest.h>

#include "mono_pose_tracker/evaluation/trajectory_error.h"
#include "mono_pose_tracker/tracking/tracker.h"
#include "simulation/simulated_sequence.h"
#include "support/mapper_tests.h"

namespace mono_pose_tracker {
namespace {

// A head that rotates in front of a furnished room, with a hand-held camera: most features are the room's.
SequenceOptions hand_held_head() {
  SequenceOptions options;
  options.background = BackgroundKind::kRoom;
  options.hand_held = true;
  options.camera = default_camera(SceneKind::kHead, 480, 360);
  options.frames = 30;
  options.samples = 1;
  options.seed = 2;
  return options;
}

struct ObservedObjects {
  SimulatedSequence sequence{hand_held_head()};
  std::vector<SimulatedFrame> frames;

  ObservedObjects() {
    for (int i = 0; i < sequence.size(); ++i) frames.push_back(sequence.render(i));
  }
};

// The recording, rendered once.
const ObservedObjects& recording() {
  static const ObservedObjects recording;
  return recording;
}

struct Outcome {
  std::vector<FrameReport> reports;
  double rotation_deg = 180;  // of the last map, compared with the head
};

// Live, but waits for the mapper after each image.
Outcome track_live(const std::string& wanted) {
  TrackerOptions options = unhurried_options();
  options.segmentation.body = wanted;
  Tracker tracker(options, recording().sequence.camera(), Tracker::Mapping::kThreaded);
  Outcome outcome;
  for (const SimulatedFrame& frame : recording().frames) {
    outcome.reports.push_back(tracker.process(frame.stamp_ns, frame.image));
    tracker.wait();
  }
  std::vector<StampedPose> last;
  for (const FrameReport& report : outcome.reports) {
    if (report.map_from_camera && report.map_id == outcome.reports.back().map_id) {
      last.push_back({report.stamp_ns, *report.map_from_camera});
    }
  }
  outcome.rotation_deg = evaluate_trajectory(recording().sequence.path(), last, 0).rotation_median_deg;
  return outcome;
}

TEST(LiveObject, AMapOfTheRoomIsDroppedForTheHeadThatTurns) {
  const Outcome outcome = track_live("turning");
  int dropped = 0;
  for (const FrameReport& report : outcome.reports) {
    dropped += report.reason_text.find("rotates less than another object in view; this map is dropped") !=
               std::string::npos;
    EXPECT_EQ(static_cast<int>(report.seen.size()), report.features);
  }
  EXPECT_GE(dropped, 1);
  EXPECT_GT(outcome.reports.back().epoch, 0u);
  EXPECT_EQ(outcome.reports.back().state, State::kTracking);
  EXPECT_LT(outcome.rotation_deg, 3);
}

TEST(LiveObject, WhoWantsTheLargestKeepsTheRoom) {
  const Outcome outcome = track_live("largest");
  EXPECT_EQ(outcome.reports.back().epoch, 0u);
  EXPECT_GT(outcome.rotation_deg, 4) << "the head turns by 16 degrees, the room hardly";
}

}  // namespace
}  // namespace mono_pose_tracker
