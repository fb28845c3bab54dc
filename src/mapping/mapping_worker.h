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

struct MappingWorkerOptions {
  int most_waiting = 3;             // keyframes; more would be outdated when inserted
  double max_iteration_work = 1e9;  // multiplications of an iteration, about half a second, so that a tracker
                                    // can stop soon
};

/// Runs a Mapper and other jobs one after the other. Inline, every call returns when its work is done
/// (repeatable). Threaded, the jobs run on a thread of their own, and only wait, begin and ask wait for work.
/// Background jobs of the mapper have a second thread, so that keyframes are inserted meanwhile; inline they
/// follow the job that created them.
///
/// Exceptions: a job that throws changes nothing: the mapper is as before, and a map that was to be left goes
/// on in the new epoch. Inline, the exception comes out of the call that ran the job. Threaded, the next
/// offer, insert or wait throws it, once; reset drops it. begin drops it as well, and throws the exception of
/// its own job.
///
/// Threads: one thread calls; latest and unfinished_jobs may be called from any. mutex_ guards jobs_,
/// background_job_, busy_, background_busy_, stop_, epoch_, new_options_, latest_ and error_. Only the worker
/// uses the mapper (inline: the caller), and the caller after wait().
class MappingWorker {
 public:
  using Work = std::function<void(Mapper&)>;

  /// before_job is called before every job on the thread of the job, so that a test can delay mapping.
  MappingWorker(const MapperOptions& options, bool threaded, std::function<void()> before_job = {});
  ~MappingWorker();  // drops waiting jobs, stops a running solver, joins
  MappingWorker(const MappingWorker&) = delete;
  MappingWorker& operator=(const MappingWorker&) = delete;

  /// Takes work only when the worker is idle; otherwise returns false and ignores it. `done` is called on the
  /// thread of the work, after latest() has the map that the work may have begun.
  bool offer(Work work, std::function<void()> done = {});

  /// Drops waiting jobs, as reset does, and runs `work`, which gives the mapper another map in this epoch: a
  /// new, an inactive or a restored one. Returns when that is done; until then latest() has the previous map.
  /// A background job may still be running.
  void begin(std::uint32_t epoch, Work work);
  /// Calls `question` with the mapper after the waiting jobs, and returns when it is done. A background job
  /// may still be running.
  void ask(const std::function<void(const Mapper&)>& question);
  /// Returns false and queues nothing when MappingWorkerOptions::most_waiting keyframes wait already.
  bool insert(const KeyframeCandidate& candidate);
  /// Applies a similarity to the present map (Mapper::transform), after the waiting jobs.
  void transform(const Sim3& new_from_map, std::optional<ScaleSource> scale_source);
  /// Drops the map and the waiting jobs. A running solver stops after its iteration, and its result is
  /// dropped.
  void reset(std::uint32_t epoch);
  /// Returns when no job is waiting or running, background jobs included. Inline that is always so.
  void wait();

  /// Takes effect from the next job on.
  void set_options(const MapperOptions& options);

  TrackingMapPtr latest() const;  // null: no map
  int unfinished_jobs() const;    // waiting and running ones, without background jobs

  /// Only while no job is waiting or running: after wait(), or inline.
  Mapper& mapper() { return mapper_; }
  /// Publishes changes made through mapper().
  void publish_mapper();

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
  /// has_room: asked with the mutex held, after an earlier job's error was thrown; empty: always.
  bool post(Job job, const std::function<bool()>& has_room = {});
  void wait_until_idle(bool in_background);
  void rethrow_error();
  void stop();  // and wait for both threads
  void run();
  void run_background();
  void run_job(const Job& job);
  void change(const Work& work, std::uint32_t epoch);
  void seek();
  void start_background_job(std::uint32_t epoch);
  int keyframes_waiting() const;
  void take_options();
  MapperOptions prepared(MapperOptions options) const;

  Mapper mapper_;
  const bool threaded_;
  const std::function<void()> before_job_;
  mutable std::mutex mutex_;
  std::condition_variable wake_, wake_background_, idle_;
  std::deque<Job> jobs_;
  std::optional<PendingBackgroundJob> background_job_;  // the waiting one
  bool busy_ = false;
  bool background_busy_ = false;
  bool stop_ = false;
  std::atomic<bool> cancel_{false};  // stops the running job's solver: its result is not needed
  std::atomic<bool> cancel_background_{false};
  std::uint32_t epoch_ = 0;
  std::optional<MapperOptions> new_options_;  // not yet given to the mapper
  TrackingMapPtr latest_;
  std::exception_ptr error_;  // of a failed job, until offer, insert or wait throws it
  std::thread thread_, background_thread_;
};

}  // namespace mono_pose_tracker
