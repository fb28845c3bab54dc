#pragma once

#include <cstdint>
#include <mutex>
#include <optional>

#include "mapping/mapping_worker.h"
#include "tracking/bootstrapper.h"

namespace mono_pose_tracker {

// Runs the Bootstrapper among the mapper's jobs, so that where those have a thread the images do not wait for
// it; a map that it finds is begun there as well.
//
// Threads: one thread calls, the one that calls the worker. mutex_ guards report_, report_epoch_ and
// new_options_; the bootstrapper is touched by the worker only, and by the caller after the worker's wait().
class BootstrapJob {
 public:
  BootstrapJob(const TrackerOptions& options, const CameraModel& camera) : bootstrapper_(options, camera) {}

  // Offers a frame for the map of this epoch. It is passed over while the worker is at work.
  void offer(const Frame& frame, std::uint32_t epoch, MappingWorker* worker);
  // The same for a map beside those that there are: it is not begun, the report holds it.
  void offer_additional(const Frame& frame, std::uint32_t epoch, MappingWorker* worker);
  // What became of the last frame offered in this epoch, once, when it is known. A map that is begun can be
  // had from the worker.
  std::optional<BootstrapReport> take(std::uint32_t epoch);
  // From the next frame on.
  void set_options(const TrackerOptions& options);

  // Only while nothing waits: after the worker's wait(), or inline.
  const Bootstrapper& bootstrapper() const { return bootstrapper_; }

 private:
  void post(const Frame& frame, std::uint32_t epoch, bool begins, MappingWorker* worker);
  BootstrapReport run(const Frame& frame, std::uint32_t epoch);

  Bootstrapper bootstrapper_;
  std::uint32_t bootstrapper_epoch_ = 0;  // of the frames that it holds
  std::mutex mutex_;
  std::optional<BootstrapReport> report_;
  std::uint32_t report_epoch_ = 0;
  std::optional<TrackerOptions> new_options_;  // that the bootstrapper does not have yet
};

}  // namespace mono_pose_tracker
