#include "mono_pose_tracker/tracking/mapping_worker.h"

#include <utility>

namespace mono_pose_tracker {

MappingWorker::MappingWorker(const TrackerOptions& options, const CameraModel& camera, bool threaded)
    : mapper_(options, camera), threaded_(threaded) {
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
  post({epoch, [initial, epoch](Mapper& mapper) { mapper.initialize(initial, epoch); }});
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
  post({epoch, [candidate](Mapper& mapper) { mapper.insert(candidate); }});
  return true;
}

void MappingWorker::reset(std::uint32_t epoch) {
  const std::lock_guard<std::mutex> lock(mutex_);
  jobs_.clear();
  error_ = nullptr;
  epoch_ = epoch;
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

void MappingWorker::run_job(const Job& job) {
  job.work(mapper_);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (job.epoch == epoch_) latest_ = mapper_.tracking_map();
}

}  // namespace mono_pose_tracker
