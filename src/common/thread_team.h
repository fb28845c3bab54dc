#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "common/parallel.h"

namespace mono_pose_tracker {

/// Repeated parallel_for: the threads are started once. Each thread spins for 0.1 ms after its share of the
/// work, and the caller spins until all are done. Only useful where pieces of work are shorter than 0.1 ms
/// (the time to start a thread) and follow one another.
///
/// One thread at a time may call it, and work must not call it again. Fewer threads, or none but the
/// caller's, where the system grants no more.
class ThreadTeam {
 public:
  /// The caller's thread is one of them; the others start with the first work that they can share.
  explicit ThreadTeam(int threads) : others_(threads - 1) {}
  ~ThreadTeam();
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;

  int threads() const { return others_ + 1; }

  /// As parallel_for(count, threads(), work).
  void for_each(int count, const std::function<void(int)>& work);
  /// Hands out up to `run` indices at a time, for calls that take less time than handing one out.
  template <typename Work>
  void for_runs(int count, int run, const Work& work) {
    for_each((count + run - 1) / run, [&](int r) {
      for (int i = r * run; i < (r + 1) * run && i < count; ++i) work(i);
    });
  }

 private:
  void start(int wanted);
  void help();
  bool wait_for_work(unsigned done);

  const int others_;
  int started_ = 0;  // or refused
  std::vector<std::thread> threads_;

  // Odd while there is work to take part in; it changes before anybody begins and after all is handed out.
  std::atomic<unsigned> round_{0};
  std::atomic<int> helping_{0};  // others that may be looking at the work
  std::atomic<int> asleep_{0};
  std::atomic<bool> ends_{false};
  std::mutex mutex_;  // of those asleep
  std::condition_variable work_or_end_;
  SharedWork* work_ = nullptr;  // of the present round
};

}  // namespace mono_pose_tracker
