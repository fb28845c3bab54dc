#include "mapping/mapping_worker.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "common/threads.h"

namespace mono_pose_tracker {

namespace {

constexpr MappingWorkerOptions kWorkerLimits{};

// Priorities below tracking, which must finish before the next image. Background jobs have the lowest one.
constexpr int kNiceSteps = 5, kNiceStepsBackground = 10;

// Inline mapping has no limits of time or memory, as results that depend on the clock are not repeatable.
MapperOptions unhurried(MapperOptions options) {
  options.mapping.bundle_seconds = std::numeric_limits<double>::max();
  options.mapping.window_landmarks = std::numeric_limits<int>::max();
  options.mapping.max_keyframes = 0;
  options.is_live = options.tells_background = false;
  return options;
}

}  // namespace

MappingWorker::MappingWorker(const MapperOptions& options, bool threaded, std::function<void()> before_job)
    : mapper_(options), threaded_(threaded), before_job_(std::move(before_job)) {
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
  post({std::move(work)});
  wait_until_idle(false);
}

void MappingWorker::ask(const std::function<void(const Mapper&)>& question) {
  post({question});
  wait_until_idle(false);
}

bool MappingWorker::offer(Work work, std::function<void()> done) {
  return post({std::move(work), 0, std::move(done)}, [this] { return !busy_ && jobs_.empty(); });
}

// The keyframe is published before the loop search.
bool MappingWorker::insert(const KeyframeCandidate& candidate) {
  const auto insert = [this, candidate](Mapper& mapper) {
    std::unique_lock<std::mutex> lock(mutex_);
    const int waiting = keyframes_waiting();
    lock.unlock();
    mapper.insert(candidate, waiting);
  };
  return post({insert, 0, [this] { seek(); }, true},
              [this] { return keyframes_waiting() < kWorkerLimits.most_waiting; });
}

void MappingWorker::seek() {
  std::uint32_t epoch;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (keyframes_waiting() > 0) return;
    epoch = epoch_;
  }
  const auto search = [](Mapper& mapper) {
    mapper.seek_loop();
    mapper.adjust_now_and_then();
  };
  change(search, epoch);
}

void MappingWorker::transform(const Sim3& new_from_map, std::optional<ScaleSource> scale_source) {
  post({[=](Mapper& mapper) { mapper.transform(new_from_map, scale_source); }});
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

void MappingWorker::wait() { wait_until_idle(true); }

// A background job of an abandoned map ends by itself.
void MappingWorker::wait_until_idle(bool in_background) {
  if (!threaded_) return;
  std::unique_lock<std::mutex> lock(mutex_);
  idle_.wait(lock, [&] {
    return jobs_.empty() && !busy_ && !(in_background && (background_job_ || background_busy_));
  });
  rethrow_error();
}

// With the mutex held.
void MappingWorker::rethrow_error() {
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

TrackingMapPtr MappingWorker::latest() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return latest_;
}

int MappingWorker::unfinished_jobs() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return static_cast<int>(jobs_.size()) + busy_;
}

// With the mutex held.
int MappingWorker::keyframes_waiting() const {
  return static_cast<int>(
      std::count_if(jobs_.begin(), jobs_.end(), [](const Job& job) { return job.is_keyframe; }));
}

void MappingWorker::publish_mapper() {
  TrackingMapPtr map = mapper_.tracking_map();
  const std::lock_guard<std::mutex> lock(mutex_);
  if (map && map->epoch == epoch_) latest_.swap(map);
}

bool MappingWorker::post(Job job, const std::function<bool()>& has_room) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (has_room) {
      rethrow_error();
      if (!has_room()) return false;
    }
    job.epoch = epoch_;
    if (threaded_) jobs_.push_back(std::move(job));
  }
  if (threaded_) {
    wake_.notify_one();
  } else {
    run_job(job);
  }
  return true;
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
  change(job.work, job.epoch);
  if (job.done) job.done();
  start_background_job(job.epoch);
}

// Runs a change of the mapper, and publishes it.
void MappingWorker::change(const Work& work, std::uint32_t epoch) {
  const Mapper::Checkpoint before = mapper_.checkpoint();
  try {
    work(mapper_);
  } catch (...) {
    mapper_.go_back(before);
    if (latest() && mapper_.tracking_map()->epoch != epoch)
      mapper_.resume(mapper_.tracking_map()->map_id, true, epoch);
    publish_mapper();
    throw;
  }
  publish_mapper();
}

void MappingWorker::start_background_job(std::uint32_t epoch) {
  BackgroundJob background_job = mapper_.take_background_job();
  for (; background_job && !threaded_; background_job = mapper_.take_background_job())
    change(background_job([] { return false; }), epoch);
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
    options.bundle.max_iteration_work = kWorkerLimits.max_iteration_work;
  } else {
    options = unhurried(std::move(options));
  }
  options.bundle.cancel = [this, asked = options.bundle.cancel] { return cancel_ || (asked && asked()); };
  return options;
}

}  // namespace mono_pose_tracker
