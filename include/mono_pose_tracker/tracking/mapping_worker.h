#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

#include "mono_pose_tracker/tracking/mapper.h"

namespace mono_pose_tracker {

/// Runs a Mapper inline (every call returns when its work is done: repeatable) or on a thread of its own.
///
/// Threads: one thread calls; latest and backlog may be called from any. mutex_ guards jobs_, busy_, stop_,
/// epoch_ and latest_; the mapper itself is touched by the worker only (inline: by the caller), and by the
/// caller after wait().
class MappingWorker {
 public:
  MappingWorker(const TrackerOptions& options, const CameraModel& camera, bool threaded);
  ~MappingWorker();  // drops what waits, joins
  MappingWorker(const MappingWorker&) = delete;
  MappingWorker& operator=(const MappingWorker&) = delete;

  /// Begins a map; returns when it is there.
  void initialize(const InitialMap& initial, std::uint32_t epoch);
  /// False, and nothing queued, when kMaxBacklog keyframes wait already.
  bool insert(const KeyframeCandidate& candidate);
  /// Drops the map and what waits. A result of work under way is dropped when it comes.
  void reset(std::uint32_t epoch);
  /// Returns when nothing waits.
  void wait();

  TrackingMapPtr latest() const;  // null: no map
  int backlog() const;

  /// Only while nothing waits: after wait(), or inline.
  Mapper& mapper() { return mapper_; }
  /// After changes made through mapper().
  void publish_mapper();

  static constexpr int kMaxBacklog = 3;  // keyframes: more are older than the view they were taken for

 private:
  struct Job {
    std::uint32_t epoch = 0;
    std::function<void(Mapper&)> work;
  };

  void post(Job job);
  void run();
  void run_job(const Job& job);

  Mapper mapper_;
  const bool threaded_;
  mutable std::mutex mutex_;
  std::condition_variable wake_, idle_;
  std::deque<Job> jobs_;
  bool busy_ = false;
  bool stop_ = false;
  std::uint32_t epoch_ = 0;
  TrackingMapPtr latest_;
  std::exception_ptr error_;  // of a job that failed: the caller's next insert or wait throws it
  std::thread thread_;
};

}  // namespace mono_pose_tracker
