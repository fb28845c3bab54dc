#include "mono_pose_tracker/mapping/mapping_worker.h"

#include <limits>
#include <utility>

namespace mono_pose_tracker {

namespace {

// Multiplications: about half a second, so that a tracker that ends need not wait long for it.
constexpr double kMaxIterationWork = 1e9;

// Inline nobody waits for the mapper: nothing is left out for the sake of time or memory, and no result is
// cut short by the clock, which would not repeat.
MapperOptions unhurried(MapperOptions options) {
  options.mapping.bundle_seconds = std::numeric_limits<double>::max();
  options.mapping.window_landmarks = std::numeric_limits<int>::max();
  options.mapping.max_keyframes = 0;
  return options;
}

}  // namespace

MappingWorker::MappingWorker(const MapperOptions& options, const CameraModel& camera, bool threaded,
                             std::function<void()> before_job)
    : mapper_(options, camera), threaded_(threaded), before_job_(std::move(before_job)) {
  mapper_.set_options(prepared(options));
  if (threaded_) thread_ = std::thread([this] { run(); });
}

MappingWorker::~MappingWorker() {
  if (!threaded_) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
    cancel_ = true;
    jobs_.clear();
  }
  wake_.notify_all();
  thread_.join();
}

void MappingWorker::initialize(const InitialMap& initial, std::uint32_t epoch) {
  reset(epoch);
  post({[initial, epoch](Mapper& mapper) { mapper.initialize(initial, epoch); }, epoch});
  wait();
}

void MappingWorker::begin_beside(const InitialMap& initial, std::uint32_t epoch) {
  reset(epoch);
  post({[initial, epoch](Mapper& mapper) { mapper.begin_beside(initial, epoch); }, epoch});
  wait();
}

void MappingWorker::resume(std::uint32_t map_id, bool keep_present, std::uint32_t epoch) {
  reset(epoch);
  post({[=](Mapper& mapper) { mapper.resume(map_id, keep_present, epoch); }, epoch});
  wait();
}

void MappingWorker::restore(const Map& map, std::uint32_t epoch) {
  reset(epoch);
  post({[map, epoch](Mapper& mapper) { mapper.restore(map, epoch); }, epoch});
  wait();
}

void MappingWorker::restore_beside(const Map& map, std::uint32_t epoch) {
  reset(epoch);
  post({[map, epoch](Mapper& mapper) { mapper.restore_beside(map, epoch); }, epoch});
  wait();
}

bool MappingWorker::offer(Work work, std::function<void()> done) {
  std::uint32_t epoch;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
    if (busy_ || !jobs_.empty()) return false;
    epoch = epoch_;
  }
  post({std::move(work), epoch, std::move(done)});
  return true;
}

bool MappingWorker::insert(const KeyframeCandidate& candidate) {
  std::uint32_t epoch;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
    if (static_cast<int>(jobs_.size()) >= kMaxBacklog) return false;
    epoch = epoch_;
  }
  post({[this, candidate](Mapper& mapper) { mapper.insert(candidate, waiting()); }, epoch});
  return true;
}

void MappingWorker::reset(std::uint32_t epoch) {
  const std::lock_guard<std::mutex> lock(mutex_);
  jobs_.clear();
  if (busy_) cancel_ = true;
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

int MappingWorker::waiting() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return static_cast<int>(jobs_.size());
}

void MappingWorker::publish_mapper() {
  const std::lock_guard<std::mutex> lock(mutex_);
  const TrackingMapPtr map = mapper_.tracking_map();
  if (map && map->epoch == epoch_) latest_ = map;
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
    cancel_ = false;
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

void MappingWorker::set_options(const MapperOptions& options) {
  const std::lock_guard<std::mutex> lock(mutex_);
  new_options_ = options;
}

void MappingWorker::run_job(const Job& job) {
  if (before_job_) before_job_();
  take_options();
  job.work(mapper_);
  publish_mapper();
  if (job.done) job.done();
}

void MappingWorker::take_options() {
  std::optional<MapperOptions> options;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    options = std::exchange(new_options_, std::nullopt);
  }
  if (options) mapper_.set_options(prepared(*options));
}

MapperOptions MappingWorker::prepared(MapperOptions options) const {
  if (threaded_) {
    options.bundle.max_iteration_work = kMaxIterationWork;
  } else {
    options = unhurried(std::move(options));
  }
  options.bundle.cancel = [this, asked = options.bundle.cancel] { return cancel_ || (asked && asked()); };
  return options;
}

}  // namespace mono_pose_tracker
