#include "common/threads.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <iterator>
#include <utility>

#ifdef __linux__
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

namespace mono_pose_tracker {

ThreadTeam::~ThreadTeam() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
  }
  work_or_end_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

// No more than there is work for; what the system refuses is not asked for again.
void ThreadTeam::start(int wanted) {
  if (wanted <= started_) return;
  threads_.reserve(static_cast<std::size_t>(others_));  // nothing may throw once they run
  std::vector<std::thread> more = start_threads(wanted - started_, [this] { help(); });
  started_ = wanted;
  std::move(more.begin(), more.end(), std::back_inserter(threads_));
}

void ThreadTeam::for_each(int count, const std::function<void(int)>& work) {
  if (others_ <= 0 || count <= 1) {
    parallel_for(count, 1, work);
    return;
  }
  start(std::min(others_, count - 1));
  SharedWork shared(count, work);
  work_ = &shared;
  ++round_;
  if (asleep_ > 0) {
    { const std::lock_guard<std::mutex> lock(mutex_); }  // who is about to sleep does so, and is woken
    work_or_end_.notify_all();
  }
  shared.take_part();
  ++round_;
  // Who comes later sees that this round is over, and does not touch what it was about.
  while (helping_ > 0) std::this_thread::yield();
  shared.rethrow_error();
}

void ThreadTeam::help() {
  unsigned done = 0;
  while (wait_for_work(done)) {
    const unsigned round = round_;
    ++helping_;
    if (round % 2 == 1 && round == round_) work_->take_part();
    --helping_;
    done = round;
  }
}

// For another round than that; false at the end.
bool ThreadTeam::wait_for_work(unsigned done) {
  const auto is_over = [&] { return round_ != done || ends_; };
  // To wake a thread that sleeps takes as long as this.
  const auto sleeps_at = std::chrono::steady_clock::now() + std::chrono::microseconds(100);
  // Where others have work for this processor, they have it.
  while (!is_over() && std::chrono::steady_clock::now() < sleeps_at) std::this_thread::yield();
  if (!is_over()) {
    std::unique_lock<std::mutex> lock(mutex_);
    ++asleep_;
    work_or_end_.wait(lock, is_over);
    --asleep_;
  }
  return !ends_;
}

namespace {

#ifdef __linux__
// As the kernel has it (linux/sched/types.h, which newer C libraries clash with), first version.
struct SchedulingAttributes {
  std::uint32_t size = sizeof(SchedulingAttributes);
  std::uint32_t policy = SCHED_OTHER;
  std::uint64_t flags = 0;
  std::int32_t nice = 0;
  std::uint32_t priority = 0;
  std::uint64_t runtime = 0;  // ns, the slice; ignored before Linux 6.12
  std::uint64_t deadline = 0;
  std::uint64_t period = 0;
};
#endif

}  // namespace

void lower_thread_priority(int steps) {
#ifdef __linux__
  // On Linux niceness is a thread's own. (POSIX says the process's.)
  const auto thread = static_cast<id_t>(syscall(SYS_gettid));
  setpriority(PRIO_PROCESS, thread, getpriority(PRIO_PROCESS, thread) + steps);
  SchedulingAttributes attributes;
  if (syscall(SYS_sched_getattr, 0, &attributes, sizeof attributes, 0) != 0) return;
  if (attributes.policy != SCHED_OTHER) return;  // what was chosen stays
  // A thread that wakes waits until the running thread has had its slice of some ms, however much nicer that
  // one is: the threads that help tracking for a fraction of a millisecond would come too late. This slice,
  // in ns, is the shortest that Linux accepts.
  attributes.runtime = 100'000;
  syscall(SYS_sched_setattr, 0, &attributes, 0);
#else
  static_cast<void>(steps);
#endif
}

}  // namespace mono_pose_tracker
