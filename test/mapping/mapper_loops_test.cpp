// Loop closing in the background.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <stdexcept>
#include <thread>

#include "mapping/mapping_worker.h"
#include "optimization/map_adjustment.h"
#include "simulation/walk_studies.h"
#include "support/mapper_tests.h"
#include "support/synthetic_views.h"

namespace mono_pose_tracker {
namespace {

constexpr double kLoopNoise = 0.5;  // px

// A ring-shaped path with a worker that closes loops.
class MapperLoopsTest : public testing::Test {
 protected:
  ~MapperLoopsTest() override { let_go(); }

  static MapperOptions with_cancel(MapperOptions options, std::function<bool()> cancel) {
    options.bundle.cancel = std::move(cancel);
    return options;
  }

  // With loop closing alone, or as live, with a global adjustment now and then.
  void begin(bool threaded, bool is_live = false) {
    // Without a time limit: on a busy machine the map would drift more than loops are searched for.
    options_.mapping.bundle_seconds = 1e6;
    MapperOptions options = with_cancel(options_.mapper(camera_.focal()), [this] { return ask(); });
    options.is_live = is_live;
    worker_ = std::make_unique<MappingWorker>(options, threaded,
                                              [this] { mapping_thread_ = std::this_thread::get_id(); });
    const InitialMap initial = true_beginning(walk_, camera_, kLoopNoise, random_);
    worker_->begin(0, [&](Mapper& mapper) { mapper.initialize(initial, 0); });
  }

  // Called by solvers after each iteration: those of background jobs are held while `held`, or throw.
  bool ask() {
    if (std::this_thread::get_id() == mapping_thread_) return false;
    if (fails_) throw std::runtime_error("no memory, say");
    if (!hold_) return false;
    if (!std::exchange(arrived_, true)) at_gate_.set_value();
    gate_.get_future().wait();
    hold_ = false;
    return false;
  }
  void let_go() {
    if (!std::exchange(open_, true)) gate_.set_value();
  }
  // Whether a solver is held. Near the end of the ring it may still be starting: waits for it, as on a slow
  // machine the rest of the path would be over before.
  bool is_held(int index, const std::future<void>& arrived) const {
    const std::chrono::milliseconds time(index < 4 * frames() / 5 ? 0 : 100);
    return arrived.wait_for(time) == std::future_status::ready;
  }

  bool insert(int index) {
    const Frame frame = walk_frame(walk_, camera_, index, kLoopNoise, random_);
    if (!worker_->insert(registered_candidate(options_, camera_, *worker_->latest(), frame))) return false;
    while (worker_->unfinished_jobs() > 0) std::this_thread::yield();
    return true;
  }

  // RMSE of all keyframes' positions after a similarity, m.
  double position_rmse() const {
    const TrackingMapPtr map = worker_->latest();
    std::vector<Eigen::Vector3d> found, truth;
    for (const auto& [id, keyframe] : map->keyframes) {
      found.push_back(keyframe.camera_from_map.inverse().translation);
      truth.push_back(walk_.camera_from_world[keyframe.frame_index].inverse().translation);
    }
    return aligned_rmse(found, truth);
  }

  int frames() const { return static_cast<int>(walk_.camera_from_world.size()); }

  Random random_{5};
  TrackerOptions options_;
  CameraModel camera_ = synthetic_camera();
  FeatureWalk walk_ = ring_walk(1);
  std::unique_ptr<MappingWorker> worker_;
  std::atomic<std::thread::id> mapping_thread_{};
  std::atomic<bool> hold_{false}, fails_{false};
  std::promise<void> at_gate_, gate_;
  bool arrived_ = false, open_ = false;
};

TEST_F(MapperLoopsTest, ALoopPostsACorrectionForEveryKeyframe) {
  begin(false);
  int i = 2;
  while (i < frames() && worker_->latest()->corrections.empty()) insert(i++);
  const TrackingMapPtr map = worker_->latest();
  ASSERT_EQ(worker_->mapper().loops().size(), 1u) << "no loop in " << i << " frames";
  EXPECT_EQ(worker_->mapper().loops()[0].to_frame, i - 1);
  ASSERT_EQ(map->corrections.size(), 2u) << "the drift spread, then all adjusted";
  for (const auto& correction : map->corrections) {
    EXPECT_EQ(correction->of_map, map->map_id);
    EXPECT_EQ(correction->into_map, map->map_id);
    for (const auto& entry : map->keyframes) EXPECT_EQ(correction->scale_of.count(entry.first), 1u);
    for (const auto& entry : map->removed_keyframes) EXPECT_EQ(correction->scale_of.count(entry.first), 1u);
  }
  worker_->mapper().map().check();
  // A closed loop is not found again.
  while (i < frames()) insert(i++);
  EXPECT_EQ(worker_->latest()->corrections.size(), 2u);
  EXPECT_LT(position_rmse(), 0.03);
}

// A correction of the scale also changes the covariances of lengths.
TEST_F(MapperLoopsTest, CovariancesChangeWithTheLengthsOfTheirKeyframes) {
  begin(false);
  TrackingMapPtr before = worker_->latest();
  for (int i = 2; i < frames() && worker_->latest()->corrections.empty(); ++i) {
    before = worker_->latest();
    insert(i);
  }
  const TrackingMapPtr after = worker_->latest();
  ASSERT_EQ(after->corrections.size(), 2u);
  int compared = 0;
  double most_scaled = 0;
  for (const auto& [id, covariance] : before->covariances) {
    const auto now = after->covariances.find(id);
    if (now == after->covariances.end()) continue;
    // Covariances of the newest window were computed before the loop was closed.
    const Matrix6d now_covariance = now->second;
    if (now_covariance.bottomRightCorner<3, 3>() != covariance.bottomRightCorner<3, 3>()) continue;
    const double scale = after->corrections[0]->length_scale(id) * after->corrections[1]->length_scale(id);
    const double ratio =
        now_covariance.topLeftCorner<3, 3>().trace() / covariance.topLeftCorner<3, 3>().trace();
    EXPECT_NEAR(ratio, scale * scale, 1e-9) << id;
    most_scaled = std::max(most_scaled, std::abs(scale - 1));
    ++compared;
  }
  EXPECT_GT(compared, 10);
  EXPECT_GT(most_scaled, 0.002) << "no drift in scale: nothing was tested";
}

TEST_F(MapperLoopsTest, WhileALoopIsClosedKeyframesGoIntoTheMap) {
  begin(true);
  hold_ = true;
  std::future<void> arrived = at_gate_.get_future();
  int i = 2;
  for (; i < frames() - 5 && !is_held(i, arrived); ++i) ASSERT_TRUE(insert(i));
  // The last keyframe may have just requested it.
  ASSERT_EQ(arrived.wait_for(std::chrono::seconds(60)), std::future_status::ready) << "no loop was found";
  EXPECT_TRUE(worker_->latest()->corrections.empty());
  for (const int end = i + 4; i < end; ++i) {
    ASSERT_TRUE(insert(i)) << "a keyframe was turned away";
    EXPECT_EQ(worker_->latest()->keyframes.rbegin()->second.frame_index, i);
  }
  EXPECT_TRUE(worker_->latest()->corrections.empty()) << "it was to stand still";
  let_go();
  worker_->wait();
  EXPECT_EQ(worker_->latest()->corrections.size(), 2u);
  EXPECT_EQ(worker_->latest()->keyframes.rbegin()->second.frame_index, i - 1);
  worker_->mapper().map().check();
  EXPECT_LT(position_rmse(), 0.06) << "not closed, it is 0.11 m";
}

// Mean distance between keyframes and their globally adjusted positions, m.
double unadjusted(const Map& map) {
  Map adjusted = map;
  adjust_map(BundleOptions(), &adjusted);
  double sum = 0;
  for (const auto& [id, keyframe] : map.keyframes()) {
    sum += (keyframe.center_in_map() - adjusted.keyframe(id)->center_in_map()).norm();
  }
  return sum / static_cast<double>(map.keyframes().size());
}

TEST_F(MapperLoopsTest, WhatHasDriftedIsAdjustedNowAndThen) {
  double off[2];
  for (const bool is_live : {false, true}) {
    random_ = Random(5);
    begin(true, is_live);
    // Three quarters of the path, without any loop.
    for (int i = 2; i < 3 * frames() / 4; ++i) {
      ASSERT_TRUE(insert(i));
      worker_->wait();
    }
    EXPECT_EQ(worker_->latest()->corrections.empty(), !is_live);
    EXPECT_TRUE(worker_->mapper().loops().empty());
    worker_->mapper().map().check();
    off[is_live] = unadjusted(worker_->mapper().map());
  }
  EXPECT_LT(off[true], 0.5 * off[false]);
}

TEST_F(MapperLoopsTest, ALoopIsNotKeptWaitingByWhatIsAdjusted) {
  begin(true, true);
  std::future<void> arrived = at_gate_.get_future();
  int i = 2;
  for (; i < 3 * frames() / 5; ++i) {
    ASSERT_TRUE(insert(i));
    worker_->wait();
  }
  hold_ = true;
  for (; i < frames(); ++i) ASSERT_TRUE(insert(i));
  ASSERT_EQ(arrived.wait_for(std::chrono::seconds(60)), std::future_status::ready) << "nothing is adjusted";
  EXPECT_TRUE(worker_->mapper().loops().empty());
  let_go();
  worker_->wait();
  EXPECT_EQ(worker_->mapper().loops().size(), 1u);
  EXPECT_LT(position_rmse(), 0.06);
}

TEST_F(MapperLoopsTest, WhoeverLooksAtTheMapDoesNotWaitForWhatIsDoneAside) {
  begin(true, true);
  std::future<void> arrived = at_gate_.get_future();
  hold_ = true;
  for (int i = 2; i < 3 * frames() / 4; ++i) ASSERT_TRUE(insert(i));
  ASSERT_EQ(arrived.wait_for(std::chrono::seconds(60)), std::future_status::ready) << "nothing is adjusted";
  std::size_t keyframes = 0;
  worker_->ask([&](const Mapper& mapper) { keyframes = mapper.map().keyframes().size(); });
  EXPECT_EQ(keyframes, worker_->latest()->keyframes.size());
  EXPECT_TRUE(worker_->latest()->corrections.empty()) << "it was to stand still";
  let_go();
  worker_->wait();
}

TEST_F(MapperLoopsTest, WhatGoesWrongAsideKeepsNothingElseFromBeingDone) {
  begin(true, true);
  fails_ = true;
  int i = 2;
  bool was_told = false;
  for (; i < frames() / 2 && !was_told; ++i) {
    ASSERT_TRUE(insert(i));
    try {
      worker_->wait();
    } catch (const std::runtime_error& e) {
      was_told = true;
      EXPECT_STREQ(e.what(), "no memory, say");
    }
  }
  ASSERT_TRUE(was_told) << "nothing is adjusted";
  EXPECT_TRUE(worker_->latest()->corrections.empty());
  fails_ = false;
  for (; i < 3 * frames() / 4; ++i) {
    ASSERT_TRUE(insert(i));
    worker_->wait();
  }
  EXPECT_FALSE(worker_->latest()->corrections.empty()) << "never again";
}

TEST_F(MapperLoopsTest, WhatWasSolvedForAMapThatIsLeftIsDropped) {
  begin(true);
  hold_ = true;
  std::future<void> arrived = at_gate_.get_future();
  for (int i = 2; i < frames() && !is_held(i, arrived); ++i) ASSERT_TRUE(insert(i));
  ASSERT_EQ(arrived.wait_for(std::chrono::seconds(60)), std::future_status::ready) << "no loop was found";
  worker_->reset(1);
  EXPECT_EQ(worker_->latest(), nullptr);
  let_go();
  worker_->wait();
  EXPECT_EQ(worker_->latest(), nullptr);
}

// The result refers to the map's frame before the transformation.
TEST_F(MapperLoopsTest, WhatIsSolvedForAMapThatIsMovedIsDroppedAndSoughtAnew) {
  begin(true);
  hold_ = true;
  std::future<void> arrived = at_gate_.get_future();
  int i = 2;
  for (; i < frames() - 6 && !is_held(i, arrived); ++i) ASSERT_TRUE(insert(i));
  ASSERT_EQ(arrived.wait_for(std::chrono::seconds(60)), std::future_status::ready) << "no loop was found";
  worker_->transform(Sim3(2, Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitZ())), {3, 4, 5}),
                     std::nullopt);
  while (worker_->unfinished_jobs() > 0) std::this_thread::yield();
  const double open = position_rmse();
  let_go();
  worker_->wait();
  EXPECT_EQ(worker_->latest()->corrections.size(), 1u) << "the movement alone";
  EXPECT_DOUBLE_EQ(position_rmse(), open);
  while (i < frames()) ASSERT_TRUE(insert(i++));
  worker_->wait();
  EXPECT_GT(worker_->latest()->corrections.size(), 1u);
  EXPECT_LT(position_rmse(), 0.06);
}

}  // namespace
}  // namespace mono_pose_tracker
