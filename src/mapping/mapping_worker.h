#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "mapping/mapper.h"

namespace mono_pose_tracker {

/// Runs a Mapper and whatever else is handed to it, one job after the other: inline (every call returns when
/// its work is done: repeatable) or on a thread of its own, where no call but wait, begin and ask ever waits
/// for work. What the mapper wants done aside (aside.h) has a second thread, so that keyframes go into the
/// map meanwhile; inline it follows the job that asked for it.
///
/// An exception that a job throws comes inline out of the call that ran it. On a thread, the next offer,
/// insert or wait throws it, once; reset drops it. begin drops it as well, and throws what its own job
/// throws.
///
/// Threads: one thread calls; latest and unfinished_jobs may be called from any. mutex_ guards jobs_,
/// background_job_, busy_, background_busy_, stop_, epoch_, new_options_, latest_ and error_; the mapper is
/// touched by the worker only (inline: by the caller), and by the caller after wait().
class MappingWorker {
 public:
  using Work = std::function<void(Mapper&)>;

  /// before_job is called before every job, where the job runs: a test makes mapping slow with it.
  MappingWorker(const MapperOptions& options, const CameraModel& camera, bool threaded,
                std::function<void()> before_job = {});
  ~MappingWorker();  // drops what waits, ends the solve under way, joins
  MappingWorker(const MappingWorker&) = delete;
  MappingWorker& operator=(const MappingWorker&) = delete;

  /// Takes work only when there is nothing else to do; otherwise false, and it is passed over. `done` is
  /// called on the thread that did the work, once latest() has the map that it may have begun.
  bool offer(Work work, std::function<void()> done = {});

  /// Drops what waits, as reset does, and has `work` give the mapper another map: one that it begins, goes
  /// back to or restores, in this epoch. Returns when it is there, and until then latest() has the map
  /// before; what is done aside may still be under way.
  void begin(std::uint32_t epoch, Work work);
  /// Has the mapper looked at, after what waits; returns when that is done. What is done aside may still be
  /// under way.
  void ask(const std::function<void(const Mapper&)>& question);
  /// False, and nothing queued, when kMostKeyframesWaiting keyframes wait already.
  bool insert(const KeyframeCandidate& candidate);
  /// Moves the present map as a whole (Mapper::transform), after what waits.
  void transform(const Sim3& new_from_map, std::optional<ScaleSource> scale_source);
  /// Drops the map and what waits. A solve under way ends after its iteration; its result is dropped.
  void reset(std::uint32_t epoch);
  /// Returns when nothing waits and nothing is under way, aside neither. Inline that is always so.
  void wait();

  /// From the next job on.
  void set_options(const MapperOptions& options);

  TrackingMapPtr latest() const;  // null: no map
  int unfinished_jobs() const;    // that wait, and the one under way; what is done aside does not count

  /// Only while nothing waits: after wait(), or inline.
  Mapper& mapper() { return mapper_; }
  /// After changes made through mapper().
  void publish_mapper();

  static constexpr int kMostKeyframesWaiting = 3;  // more are older than the view they were taken for

 private:
  struct Job {
    Work work;
    std::uint32_t epoch = 0;
    std::function<void()> done = {};
    bool is_keyframe = false;
  };
  struct PendingBackgroundJob {
    BackgroundJob work;
    std::uint32_t epoch = 0;
  };

  void drop_jobs(std::uint32_t epoch);
  void post(Job job);
  void stop();  // and wait for both threads
  void run();
  void run_background();
  void run_job(const Job& job);
  void insert_and_seek(const KeyframeCandidate& candidate, Mapper& mapper);
  void start_background_job(std::uint32_t epoch);
  void wait_for_jobs();
  std::uint32_t current_epoch() const;
  int keyframes_waiting() const;
  void take_options();
  MapperOptions prepared(MapperOptions options) const;
  int waiting() const;

  Mapper mapper_;
  const bool threaded_;
  const std::function<void()> before_job_;
  mutable std::mutex mutex_;
  std::condition_variable wake_, wake_background_, idle_;
  std::deque<Job> jobs_;
  std::optional<PendingBackgroundJob> background_job_;  // that waits
  bool busy_ = false;
  bool background_busy_ = false;
  bool stop_ = false;
  std::atomic<bool> cancel_{false};  // the solve of the job under way: nobody waits for its result
  std::atomic<bool> cancel_background_{false};
  std::uint32_t epoch_ = 0;
  std::optional<MapperOptions> new_options_;  // that the mapper does not have yet
  TrackingMapPtr latest_;
  std::exception_ptr error_;  // of a job that failed, until offer, insert or wait throws it
  std::thread thread_, background_thread_;
};

}  // namespace mono_pose_tracker
