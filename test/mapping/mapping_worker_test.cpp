#include "mapping/mapping_worker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <stdexcept>
#include <thread>

#include "common/rotation.h"
#include "support/mapper_tests.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr double kWorkerNoise = 0.3;  // px

class MappingWorkerTest : public testing::Test {
 protected:
  Rigid3 pose(int frame) const { return camera_at({0.15 * frame, 0.02 * frame, 0}, 2 * kDegree * frame); }

  // Two views and their common points.
  InitialMap initial_map() {
    InitialMap map;
    std::vector<std::vector<int>> point_of(2);
    for (int v = 0; v < 2; ++v) {
      map.views.push_back(
          {synthetic_frame(scene_, camera_, pose(v), kWorkerNoise, v, random_, &point_of[v]), pose(v)});
    }
    for (std::size_t i = 0; i < scene_.x_in_map.size(); ++i) {
      InitialMap::Point point;
      point.x_in_map = scene_.x_in_map[i];
      for (int v = 0; v < 2; ++v) {
        const auto found = std::find(point_of[v].begin(), point_of[v].end(), static_cast<int>(i));
        if (found != point_of[v].end())
          point.observations.emplace_back(v, static_cast<int>(found - point_of[v].begin()));
      }
      if (point.observations.size() == 2) map.points.push_back(point);
    }
    return map;
  }

  static void begin(const InitialMap& initial, std::uint32_t epoch, MappingWorker* worker) {
    worker->begin(epoch, [&](Mapper& mapper) { mapper.initialize(initial, epoch); });
  }

  // A new view registered against the newest keyframe of the map.
  KeyframeCandidate candidate(const TrackingMap& map, int index) {
    const Frame frame = synthetic_frame(scene_, camera_, pose(index), kWorkerNoise, index, random_);
    return registered_candidate(TrackerOptions(), camera_, map, frame);
  }

  Random random_{17};
  CameraModel camera_ = synthetic_camera();
  SyntheticScene scene_ = box_scene(250, random_);
};

class OnAThreadOrInline : public MappingWorkerTest, public testing::WithParamInterface<bool> {};

TEST_P(OnAThreadOrInline, KeyframesComeToTheMap) {
  MappingWorker worker(TrackerOptions().mapper(camera_.focal()), GetParam());
  EXPECT_EQ(worker.latest(), nullptr);
  begin(initial_map(), 3, &worker);
  const TrackingMapPtr two = worker.latest();
  ASSERT_NE(two, nullptr);
  EXPECT_EQ(two->epoch, 3u);
  EXPECT_EQ(two->keyframes.size(), 2u);
  for (int i = 2; i < 6; ++i) {
    ASSERT_TRUE(worker.insert(candidate(*worker.latest(), i)));
    worker.wait();
    EXPECT_EQ(worker.unfinished_jobs(), 0);
    const TrackingMapPtr map = worker.latest();
    // A keyframe that is redundant with three others is removed, but its pose is stored.
    EXPECT_EQ(map->keyframes.size() + map->removed_keyframes.size(), static_cast<std::size_t>(i + 1));
    EXPECT_EQ(map->keyframes.rbegin()->second.frame_index, i);
  }
  EXPECT_EQ(two->keyframes.size(), 2u) << "a map handed out never changes";
  EXPECT_GT(worker.latest()->revision, two->revision);
  worker.mapper().map().check();
  // Rotations between keyframes do not depend on the map's scale.
  for (const auto& [id, keyframe] : worker.latest()->keyframes) {
    const Eigen::Quaterniond turn =
        keyframe.camera_from_map.rotation *
        worker.latest()->keyframes.begin()->second.camera_from_map.rotation.conjugate();
    const Eigen::Quaterniond truth =
        pose(static_cast<int>(keyframe.frame_index)).rotation * pose(0).rotation.conjugate();
    EXPECT_LT(rotation_angle_between(turn, truth), 0.2 * kDegree) << "keyframe " << id;
  }
}

TEST_P(OnAThreadOrInline, ResetLeavesNoMap) {
  MappingWorker worker(TrackerOptions().mapper(camera_.focal()), GetParam());
  begin(initial_map(), 0, &worker);
  const KeyframeCandidate next = candidate(*worker.latest(), 2);
  ASSERT_TRUE(worker.insert(next));
  worker.reset(1);
  EXPECT_EQ(worker.latest(), nullptr);
  worker.wait();
  EXPECT_EQ(worker.latest(), nullptr) << "what was under way belongs to the map before";
  begin(initial_map(), 1, &worker);
  ASSERT_NE(worker.latest(), nullptr);
  EXPECT_EQ(worker.latest()->epoch, 1u);
  EXPECT_EQ(worker.latest()->keyframes.size(), 2u);
}

TEST_P(OnAThreadOrInline, UntilAnotherMapIsThereTheOneBeforeIs) {
  MappingWorker worker(TrackerOptions().mapper(camera_.focal()), GetParam());
  begin(initial_map(), 0, &worker);
  const TrackingMapPtr before = worker.latest();
  TrackingMapPtr meanwhile;
  worker.begin(1, [&](Mapper& mapper) {
    meanwhile = worker.latest();
    mapper.initialize(initial_map(), 1);
  });
  EXPECT_EQ(meanwhile, before) << "who shows it must not show nothing";
  EXPECT_EQ(worker.latest()->epoch, 1u);
}

TEST_P(OnAThreadOrInline, AJobThatThrowsChangesNothing) {
  MappingWorker worker(TrackerOptions().mapper(camera_.focal()), GetParam());
  begin(initial_map(), 0, &worker);
  for (int i = 2; i < 6; ++i) {
    worker.insert(candidate(*worker.latest(), i));
    worker.wait();
  }
  const InitialMap other = initial_map();
  const KeyframeCandidate next = candidate(*worker.latest(), 6);
  Mapper untouched(TrackerOptions().mapper(camera_.focal()));
  untouched.restore(worker.mapper().map(), 0);
  const auto expect_untouched = [&] {
    const Map& map = worker.mapper().map();
    map.check();
    ASSERT_EQ(map.keyframes().size(), untouched.map().keyframes().size());
    ASSERT_EQ(map.landmark_ids(), untouched.map().landmark_ids());
    for (const auto& [id, keyframe] : untouched.map().keyframes()) {
      EXPECT_EQ(map.keyframe(id)->camera_from_map.translation, keyframe.camera_from_map.translation);
      EXPECT_EQ(map.keyframe(id)->landmark_of_feature, keyframe.landmark_of_feature);
      EXPECT_EQ(worker.latest()->keyframes.at(id).landmark_of_feature, keyframe.landmark_of_feature);
    }
    for (const LandmarkId id : map.landmark_ids())
      EXPECT_EQ(map.landmark(id)->x_in_map, untouched.map().landmark(id)->x_in_map);
    EXPECT_EQ(worker.mapper().inactive_maps(), untouched.inactive_maps());
    EXPECT_EQ(worker.latest()->map_id, 1u);
  };
  const auto fail = [](const char* text) { throw std::runtime_error(text); };
  const std::vector<MappingWorker::Work> changes = {[&](Mapper& mapper) {
                                                      mapper.insert(next);
                                                      mapper.transform(Sim3::scaling(3), std::nullopt);
                                                      fail("corrected");
                                                    },
                                                    [&](Mapper& mapper) {
                                                      mapper.begin_additional(other, 7);
                                                      mapper.resume(1, false, 8);
                                                      fail("switched");
                                                    },
                                                    [&](Mapper& mapper) {
                                                      mapper.initialize(other, 9);
                                                      fail("begun");
                                                    }};
  std::uint32_t epoch = 0;
  for (const MappingWorker::Work& change : changes) {
    EXPECT_THROW((worker.offer(change), worker.wait()), std::runtime_error);
    expect_untouched();
    EXPECT_THROW(worker.begin(++epoch, change), std::runtime_error);
    expect_untouched();
    EXPECT_EQ(worker.latest()->epoch, epoch) << "the map that was to be left goes on";
  }
  ASSERT_TRUE(worker.insert(next));
  worker.wait();
  EXPECT_EQ(worker.latest()->keyframes.rbegin()->second.frame_index, 6);
  worker.mapper().map().check();
}

INSTANTIATE_TEST_SUITE_P(Mapping, OnAThreadOrInline, testing::Bool(),
                         [](const auto& info) { return info.param ? "Threaded" : "Inline"; });

TEST_F(MappingWorkerTest, NoMoreKeyframesWaitThanMay) {
  MappingWorker worker(TrackerOptions().mapper(camera_.focal()), true);
  begin(initial_map(), 0, &worker);
  const KeyframeCandidate next = candidate(*worker.latest(), 2);
  // If insert blocked, none would be refused. Mapping takes longer than queueing, so a few calls suffice.
  int accepted = 0, refused = 0;
  for (int i = 0; i < 200 && refused == 0; ++i) {
    worker.insert(next) ? ++accepted : ++refused;
    EXPECT_LE(worker.unfinished_jobs(), MappingWorkerOptions().most_waiting + 1)
        << "those that wait and the one under way";
  }
  EXPECT_EQ(refused, 1);
  EXPECT_GE(accepted, MappingWorkerOptions().most_waiting);
  worker.wait();
  EXPECT_TRUE(worker.insert(next)) << "there is room again";
}

TEST_F(MappingWorkerTest, BehindInTimeItSolvesLessAndTheMapStaysConsistent) {
  Mapper mapper(unhurried_options().mapper(camera_.focal()));
  mapper.initialize(initial_map(), 0);
  for (int i = 2; i < 6; ++i) mapper.insert(candidate(*mapper.tracking_map(), i));
  for (const int waiting : {0, 1, 2, 3}) {
    Mapper behind = mapper;
    const KeyframeCandidate next = candidate(*behind.tracking_map(), 6);
    std::map<KeyframeId, Rigid3> before;
    for (const auto& [id, keyframe] : behind.map().keyframes()) before[id] = keyframe.camera_from_map;
    behind.insert(next, waiting);
    behind.map().check();
    EXPECT_EQ(behind.tracking_map()->keyframes.rbegin()->second.frame_index, 6);
    int moved = 0;
    for (const auto& [id, keyframe] : behind.map().keyframes()) {
      const auto known = before.find(id);
      moved += known != before.end() && known->second.translation != keyframe.camera_from_map.translation;
    }
    if (waiting == 0) {
      EXPECT_GT(moved, 0);
    } else if (waiting >= 2) {
      EXPECT_EQ(moved, 0) << "left to the next bundle adjustment";
    }
    // The next keyframe in time compensates for it.
    behind.insert(candidate(*behind.tracking_map(), 7));
    behind.map().check();
  }
}

TEST_F(MappingWorkerTest, JobsThatWaitDoNotKeepItAlive) {
  for (int trial = 0; trial < 20; ++trial) {
    MappingWorker worker(TrackerOptions().mapper(camera_.focal()), true);
    begin(initial_map(), 0, &worker);
    const KeyframeCandidate next = candidate(*worker.latest(), 2);
    for (int i = 0; i < MappingWorkerOptions().most_waiting; ++i) worker.insert(next);
  }
}

// A solver whose cancellation test signals that it is running, and that continues when `until` holds.
struct SolveUnderWay {
  std::promise<void> begun;
  std::atomic<int> asked{0};
  std::function<bool()> until;

  TrackerOptions options() {
    TrackerOptions options;
    options.bundle.cancel = [this] {
      if (until && asked++ == 0) {
        begun.set_value();
        while (!until()) std::this_thread::yield();
      }
      return false;
    };
    return options;
  }
};

TEST_F(MappingWorkerTest, ResetEndsTheSolveUnderWay) {
  SolveUnderWay solve;
  std::atomic<bool> is_reset{false};
  MappingWorker worker(solve.options().mapper(camera_.focal()), true);
  begin(initial_map(), 0, &worker);
  solve.until = [&] { return is_reset.load(); };
  ASSERT_TRUE(worker.insert(candidate(*worker.latest(), 2)));
  solve.begun.get_future().wait();
  worker.reset(1);
  is_reset = true;
  worker.wait();
  EXPECT_EQ(solve.asked, 1) << "the iteration after the reset is not begun";
  begin(initial_map(), 1, &worker);
  EXPECT_GT(solve.asked, 2) << "the next job is not cancelled";
}

TEST_F(MappingWorkerTest, DestructionEndsTheSolveUnderWay) {
  SolveUnderWay solve;
  std::atomic<bool> one_waits{false};
  {
    MappingWorker worker(solve.options().mapper(camera_.focal()), true);
    begin(initial_map(), 0, &worker);
    // The destructor drops waiting jobs.
    solve.until = [&] { return one_waits && worker.unfinished_jobs() == 1; };
    const KeyframeCandidate next = candidate(*worker.latest(), 2);
    ASSERT_TRUE(worker.insert(next));
    ASSERT_TRUE(worker.insert(next));
    one_waits = true;
    solve.begun.get_future().wait();
  }
  EXPECT_EQ(solve.asked, 1);
}

TEST_F(MappingWorkerTest, TwoHundredResetsUnderLoad) {
  MappingWorker worker(TrackerOptions().mapper(camera_.focal()), true);
  const InitialMap initial = initial_map();
  begin(initial, 0, &worker);
  const KeyframeCandidate next = candidate(*worker.latest(), 2);
  for (std::uint32_t epoch = 1; epoch <= 400; epoch += 2) {
    begin(initial, epoch, &worker);
    ASSERT_EQ(worker.latest()->epoch, epoch);
    ASSERT_EQ(worker.latest()->keyframes.size(), 2u);
    for (int i = 0; i < MappingWorkerOptions().most_waiting; ++i) worker.insert(next);
    worker.reset(epoch + 1);
    ASSERT_LE(worker.unfinished_jobs(), 1) << "only what is under way is left";
    if (epoch % 20 == 1) worker.wait();  // the running job has finished
    ASSERT_EQ(worker.latest(), nullptr);
  }
}

}  // namespace
}  // namespace mono_pose_tracker
