#include "mapping/mapping_worker.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "common/threads.h"

namespace mono_pose_tracker {

namespace {

// Priorities below tracking, which must finish before the next image. Background jobs have the lowest one.
constexpr int kNiceSteps = 5, kNiceStepsBackground = 10;

// Inline mapping has no limits of time or memory, as results that depend on the clock are not repeatable.
MapperOptions unhurried(MapperOptions options) {
  options.mapping.bundle_seconds = std::numeric_limits<double>::max();
  options.mapping.window_landmarks = std::numeric_limits<int>::max();
  options.mapping.max_keyframes = 0;
  options.watches_motions = options.tells_background = options.adjusts_all = false;
  return options;
}

}  // namespace

MappingWorker::MappingWorker(const MapperOptions& options, const CameraModel& camera, bool threaded,
                             std::function<void()> before_job, const MappingWorkerOptions& limits)
    : mapper_(options, camera), limits_(limits), threaded_(threaded), before_job_(std::move(before_job)) {
  mapper_.set_options(prepared(options));
  if (!threaded_) return;
  try {
    thread_ = std::thread([this] { run(); });
    background_thread_ = std::thread([this] { run_background(); });
  } catch (...) {  // no second thread available
    stop();
    throw;
  }
}

MappingWorker::~MappingWorker() { stop(); }

void MappingWorker::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
    cancel_ = cancel_background_ = true;
    jobs_.clear();
  }
  wake_.notify_all();
  wake_background_.notify_all();
  for (std::thread* thread : {&thread_, &background_thread_}) {
    if (thread->joinable()) thread->join();
  }
}

void MappingWorker::begin(std::uint32_t epoch, Work work) {
  drop_jobs(epoch);
  post({std::move(work), epoch});
  wait_for_jobs();
}

void MappingWorker::ask(const std::function<void(const Mapper&)>& question) {
  post({question, current_epoch()});
  wait_for_jobs();
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
    if (keyframes_waiting() >= limits_.most_waiting) return false;
    epoch = epoch_;
  }
  post({[this, candidate](Mapper& mapper) { insert_and_seek(candidate, mapper); }, epoch, {}, true});
  return true;
}

// The keyframe is published before the loop search.
void MappingWorker::insert_and_seek(const KeyframeCandidate& candidate, Mapper& mapper) {
  mapper.insert(candidate, waiting());
  publish_mapper();
  if (waiting() > 0) return;
  mapper.seek_loop();
  mapper.adjust_now_and_then();
}

void MappingWorker::transform(const Sim3& new_from_map, std::optional<ScaleSource> scale_source) {
  post({[=](Mapper& mapper) { mapper.transform(new_from_map, scale_source); }, current_epoch()});
}

void MappingWorker::reset(std::uint32_t epoch) {
  drop_jobs(epoch);
  TrackingMapPtr latest;  // freed outside the mutex
  const std::lock_guard<std::mutex> lock(mutex_);
  latest_.swap(latest);
}

void MappingWorker::drop_jobs(std::uint32_t epoch) {
  // Jobs hold whole maps and images: they are freed outside the mutex.
  std::deque<Job> jobs;
  std::optional<PendingBackgroundJob> background_job;
  const std::lock_guard<std::mutex> lock(mutex_);
  jobs_.swap(jobs);
  background_job_.swap(background_job);
  if (busy_) cancel_ = true;
  if (background_busy_) cancel_background_ = true;
  error_ = nullptr;
  epoch_ = epoch;
}

void MappingWorker::wait() {
  if (!threaded_) return;
  std::unique_lock<std::mutex> lock(mutex_);
  idle_.wait(lock, [this] { return jobs_.empty() && !busy_ && !background_job_ && !background_busy_; });
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

// A background job of an abandoned map ends by itself.
void MappingWorker::wait_for_jobs() {
  if (!threaded_) return;
  std::unique_lock<std::mutex> lock(mutex_);
  idle_.wait(lock, [this] { return jobs_.empty() && !busy_; });
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

TrackingMapPtr MappingWorker::latest() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return latest_;
}

std::uint32_t MappingWorker::current_epoch() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return epoch_;
}

int MappingWorker::unfinished_jobs() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return static_cast<int>(jobs_.size()) + busy_;
}

int MappingWorker::waiting() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return keyframes_waiting();
}

int MappingWorker::keyframes_waiting() const {
  return static_cast<int>(
      std::count_if(jobs_.begin(), jobs_.end(), [](const Job& job) { return job.is_keyframe; }));
}

void MappingWorker::publish_mapper() {
  TrackingMapPtr map = mapper_.tracking_map();
  const std::lock_guard<std::mutex> lock(mutex_);
  if (map && map->epoch == epoch_) latest_.swap(map);
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
  lower_thread_priority(kNiceSteps);
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return stop_ || !jobs_.empty(); });
    if (stop_) return;
    Job job = std::move(jobs_.front());
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
    const std::uint32_t epoch = job.epoch;
    job = Job();  // its data is freed outside the mutex
    lock.lock();
    if (error && epoch == epoch_) error_ = error;
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
  start_background_job(job.epoch);
}

void MappingWorker::start_background_job(std::uint32_t epoch) {
  BackgroundJob background_job = mapper_.take_background_job();
  for (; background_job && !threaded_; background_job = mapper_.take_background_job()) {
    background_job([] { return false; })(mapper_);
    publish_mapper();
  }
  if (!background_job) return;
  std::optional<PendingBackgroundJob> job = PendingBackgroundJob{std::move(background_job), epoch};
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (epoch != epoch_) return;
    if (background_busy_) cancel_background_ = true;  // the running job is obsolete
    background_job_.swap(job);
  }
  wake_background_.notify_one();
}

void MappingWorker::run_background() {
  lower_thread_priority(kNiceStepsBackground);
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    wake_background_.wait(lock, [this] { return stop_ || background_job_; });
    if (stop_) return;
    PendingBackgroundJob job = *std::exchange(background_job_, std::nullopt);
    background_busy_ = true;
    cancel_background_ = false;
    lock.unlock();
    Job rest{job.work([this] { return cancel_background_.load(); }), job.epoch};
    job = PendingBackgroundJob();  // its map is freed outside the mutex
    lock.lock();
    background_busy_ = false;
    if (rest.work && rest.epoch == epoch_ && !stop_) jobs_.push_front(std::exchange(rest, Job()));
    wake_.notify_one();
    idle_.notify_all();
    lock.unlock();
    rest = Job();
    lock.lock();
  }
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
    options.bundle.max_iteration_work = limits_.max_iteration_work;
  } else {
    options = unhurried(std::move(options));
  }
  options.bundle.cancel = [this, asked = options.bundle.cancel] { return cancel_ || (asked && asked()); };
  return options;
}

}  // namespace mono_pose_tracker
