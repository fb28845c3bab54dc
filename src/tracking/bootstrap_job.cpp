#include "bootstrap_job.h"

#include <memory>
#include <utility>

namespace mono_pose_tracker {

std::optional<BootstrapReport> BootstrapJob::add(const Frame& frame, std::uint32_t epoch, bool begins,
                                                 MappingWorker* worker) {
  std::optional<BootstrapReport> known = take(epoch);
  if (known && (known->is_begun || known->map)) return known;
  const auto report = std::make_shared<BootstrapReport>();
  worker->offer(
      [this, frame, epoch, begins, report](Mapper& mapper) {
        *report = run(frame, epoch);
        if (!report->map || !begins) return;
        mapper.initialize(*report->map, epoch);
        report->map.reset();
        report->is_begun = true;
      },
      [this, epoch, report] {
        const std::lock_guard<std::mutex> lock(mutex_);
        report_ = std::move(*report);
        report_epoch_ = epoch;
      });
  if (!known) known = take(epoch);
  return known;
}

std::optional<BootstrapReport> BootstrapJob::take(std::uint32_t epoch) {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::optional<BootstrapReport> report = std::exchange(report_, std::nullopt);
  if (report_epoch_ != epoch) report.reset();
  return report;
}

void BootstrapJob::set_options(const TrackerOptions& options) {
  const std::lock_guard<std::mutex> lock(mutex_);
  new_options_ = options;
}

BootstrapReport BootstrapJob::run(const Frame& frame, std::uint32_t epoch) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (new_options_) bootstrapper_.set_options(*new_options_);
    new_options_.reset();
  }
  if (std::exchange(bootstrapper_epoch_, epoch) != epoch) bootstrapper_.reset();
  BootstrapReport report = bootstrapper_.add(frame);
  report.motions = bootstrapper_.motions();
  if (report.map) bootstrapper_.reset();
  return report;
}

}  // namespace mono_pose_tracker
