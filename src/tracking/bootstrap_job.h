#pragma once

#include <cstdint>
#include <mutex>
#include <optional>

#include "mapping/mapping_worker.h"
#include "tracking/bootstrapper.h"

namespace mono_pose_tracker {

// Runs the Bootstrapper among the mapper's jobs, so that images do not wait for it where those jobs have a
// thread. A map that it finds is begun there as well.
//
// Threads: one thread calls, the one that calls the worker. mutex_ guards report_, report_epoch_ and
// new_options_; only the worker uses the bootstrapper, and the caller after the worker's wait().
class BootstrapJob {
 public:
  BootstrapJob(const TrackerOptions& options, const CameraModel& camera) : bootstrapper_(options, camera) {}

  // Offers a frame for the map of this epoch, unless a map was found: it is ignored while the worker is busy.
  // begins: the worker begins the map that is found; otherwise the report holds it. Returns what take()
  // returns: threaded, the result of an earlier frame.
  std::optional<BootstrapReport> add(const Frame& frame, std::uint32_t epoch, bool begins,
                                     MappingWorker* worker);
  // The result of the last frame offered in this epoch, returned once, when it is known.
  std::optional<BootstrapReport> take(std::uint32_t epoch);
  // Takes effect from the next frame on.
  void set_options(const TrackerOptions& options);

  // Only while no job is waiting or running: after the worker's wait(), or inline.
  const Bootstrapper& bootstrapper() const { return bootstrapper_; }

 private:
  BootstrapReport run(const Frame& frame, std::uint32_t epoch);

  Bootstrapper bootstrapper_;
  std::uint32_t bootstrapper_epoch_ = 0;  // of its frames
  std::mutex mutex_;
  std::optional<BootstrapReport> report_;
  std::uint32_t report_epoch_ = 0;
  std::optional<TrackerOptions> new_options_;  // not yet given to the bootstrapper
};

}  // namespace mono_pose_tracker
