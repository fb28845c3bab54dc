#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "mono_pose_tracker/tracking/mapper.h"

namespace mono_pose_tracker {

/// Runs a Bootstrapper and then a Mapper, inline (every call returns when its work is done: repeatable) or on
/// a thread of its own, where no call but wait and initialize ever waits for work.
///
/// Threads: one thread calls; latest and backlog may be called from any. mutex_ guards jobs_, busy_, stop_,
/// epoch_, new_options_, bootstrap_ and latest_; bootstrapper and mapper are touched by the worker only
/// (inline: by the caller), and by the caller after wait().
class MappingWorker {
 public:
  /// before_job is called before every job, where the job runs: a test makes mapping slow with it.
  MappingWorker(const TrackerOptions& options, const CameraModel& camera, bool threaded,
                std::function<void()> before_job = {});
  ~MappingWorker();  // drops what waits, joins
  MappingWorker(const MappingWorker&) = delete;
  MappingWorker& operator=(const MappingWorker&) = delete;

  /// Offers a frame for the first map. False, and the frame is passed over, while an earlier one is at work.
  bool bootstrap(const Frame& frame);
  /// What became of the last frame offered, once, when it is known. With a map in it, that map is begun.
  std::optional<BootstrapReport> take_bootstrap();

  /// Begins a map; returns when it is there.
  void initialize(const InitialMap& initial, std::uint32_t epoch);
  /// Goes on in a map that was saved; returns when it is there.
  void restore(const Map& map, std::uint32_t epoch);
  /// False, and nothing queued, when kMaxBacklog keyframes wait already.
  bool insert(const KeyframeCandidate& candidate);
  /// Drops the map and what waits. A result of work under way is dropped when it comes.
  void reset(std::uint32_t epoch);
  /// Returns when nothing waits.
  void wait();

  /// From the next job on.
  void set_options(const TrackerOptions& options);

  TrackingMapPtr latest() const;  // null: no map
  int backlog() const;

  /// Only while nothing waits: after wait(), or inline.
  Mapper& mapper() { return mapper_; }
  Bootstrapper& bootstrapper() { return bootstrapper_; }
  /// After changes made through mapper().
  void publish_mapper();

  static constexpr int kMaxBacklog = 3;  // keyframes: more are older than the view they were taken for

 private:
  struct Job {
    std::uint32_t epoch = 0;
    std::function<void()> work;
  };

  void post(Job job);
  void run();
  void run_job(const Job& job);
  void take_options();
  void bootstrap_with(const Frame& frame, std::uint32_t epoch);
  void publish(std::uint32_t epoch);
  int waiting() const;

  Bootstrapper bootstrapper_;
  std::uint32_t bootstrapper_epoch_ = 0;  // of the frames that it holds
  Mapper mapper_;
  const bool threaded_;
  const std::function<void()> before_job_;
  mutable std::mutex mutex_;
  std::condition_variable wake_, idle_;
  std::deque<Job> jobs_;
  bool busy_ = false;
  bool stop_ = false;
  std::uint32_t epoch_ = 0;
  std::optional<BootstrapReport> bootstrap_;
  std::optional<TrackerOptions> new_options_;  // that bootstrapper and mapper do not have yet
  TrackingMapPtr latest_;
  std::exception_ptr error_;  // of a job that failed: the caller's next insert or wait throws it
  std::thread thread_;
};

}  // namespace mono_pose_tracker
