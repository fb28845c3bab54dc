#include "mono_pose_tracker/tracking/mapping_worker.h"

#include <limits>
#include <utility>

namespace mono_pose_tracker {

namespace {

// Inline nobody waits for the mapper: nothing is left out for the sake of time, and no result is cut short by
// the clock, which would not repeat.
TrackerOptions unhurried(TrackerOptions options) {
  options.mapping.bundle_seconds = std::numeric_limits<double>::max();
  options.mapping.window_landmarks = std::numeric_limits<int>::max();
  return options;
}

}  // namespace

MappingWorker::MappingWorker(const TrackerOptions& options, const CameraModel& camera, bool threaded,
                             std::function<void()> before_job)
    : bootstrapper_(options, camera),
      mapper_(threaded ? options : unhurried(options), camera),
      threaded_(threaded),
      before_job_(std::move(before_job)) {
  if (threaded_) thread_ = std::thread([this] { run(); });
}

MappingWorker::~MappingWorker() {
  if (!threaded_) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
    jobs_.clear();
  }
  wake_.notify_all();
  thread_.join();
}

void MappingWorker::initialize(const InitialMap& initial, std::uint32_t epoch) {
  reset(epoch);
  post({epoch, [this, initial, epoch] {
          mapper_.initialize(initial, epoch);
          publish(epoch);
        }});
  wait();
}

bool MappingWorker::bootstrap(const Frame& frame) {
  std::uint32_t epoch;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
    if (busy_ || !jobs_.empty()) return false;
    epoch = epoch_;
  }
  post({epoch, [this, frame, epoch] { bootstrap_with(frame, epoch); }});
  return true;
}

std::optional<BootstrapReport> MappingWorker::take_bootstrap() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(bootstrap_, std::nullopt);
}

void MappingWorker::restore(const Map& map, std::uint32_t epoch) {
  reset(epoch);
  post({epoch, [this, map, epoch] {
          mapper_.restore(map, epoch);
          publish(epoch);
        }});
  wait();
}

bool MappingWorker::insert(const KeyframeCandidate& candidate) {
  std::uint32_t epoch;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
    if (static_cast<int>(jobs_.size()) >= kMaxBacklog) return false;
    epoch = epoch_;
  }
  post({epoch, [this, candidate, epoch] {
          mapper_.insert(candidate, waiting());
          publish(epoch);
        }});
  return true;
}

void MappingWorker::reset(std::uint32_t epoch) {
  const std::lock_guard<std::mutex> lock(mutex_);
  jobs_.clear();
  error_ = nullptr;
  epoch_ = epoch;
  bootstrap_.reset();
  latest_.reset();
}

void MappingWorker::wait() {
  if (!threaded_) return;
  std::unique_lock<std::mutex> lock(mutex_);
  idle_.wait(lock, [this] { return jobs_.empty() && !busy_; });
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

TrackingMapPtr MappingWorker::latest() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return latest_;
}

int MappingWorker::backlog() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return static_cast<int>(jobs_.size()) + busy_;
}

int MappingWorker::waiting() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return static_cast<int>(jobs_.size());
}

void MappingWorker::publish_mapper() {
  const std::lock_guard<std::mutex> lock(mutex_);
  latest_ = mapper_.tracking_map();
}

void MappingWorker::post(Job job) {
  if (!threaded_) {
    run_job(job);
    return;
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    jobs_.push_back(std::move(job));
  }
  wake_.notify_one();
}

void MappingWorker::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return stop_ || !jobs_.empty(); });
    if (stop_) return;
    const Job job = std::move(jobs_.front());
    jobs_.pop_front();
    busy_ = true;
    lock.unlock();
    std::exception_ptr error;
    try {
      run_job(job);
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    if (error && job.epoch == epoch_) error_ = error;
    busy_ = false;
    idle_.notify_all();
  }
}

void MappingWorker::set_options(const TrackerOptions& options) {
  const std::lock_guard<std::mutex> lock(mutex_);
  new_options_ = options;
}

void MappingWorker::run_job(const Job& job) {
  if (before_job_) before_job_();
  take_options();
  job.work();
}

void MappingWorker::take_options() {
  std::optional<TrackerOptions> options;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    options = std::exchange(new_options_, std::nullopt);
  }
  if (!options) return;
  bootstrapper_.set_options(*options);
  mapper_.set_options(threaded_ ? *options : unhurried(*options));
}

void MappingWorker::bootstrap_with(const Frame& frame, std::uint32_t epoch) {
  if (std::exchange(bootstrapper_epoch_, epoch) != epoch) bootstrapper_.reset();
  BootstrapReport report = bootstrapper_.add(frame);
  report.motions = bootstrapper_.motions();
  if (report.map) {
    mapper_.initialize(*report.map, epoch);
    bootstrapper_.reset();
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  if (epoch != epoch_) return;
  if (report.map) latest_ = mapper_.tracking_map();
  bootstrap_ = std::move(report);
}

void MappingWorker::publish(std::uint32_t epoch) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (epoch == epoch_) latest_ = mapper_.tracking_map();
}

}  // namespace mono_pose_tracker
