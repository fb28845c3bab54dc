#include "common/thread_priority.h"

#include <cstdint>

#ifdef __linux__
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

namespace mono_pose_tracker {

namespace {

#ifdef __linux__
// ns. What wakes waits until the thread that runs has had its slice, of some ms, however much nicer that is:
// the threads that help tracking for a fraction of a millisecond would come too late. The least there is.
constexpr std::uint64_t kShortSlice = 100'000;

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
  attributes.runtime = kShortSlice;
  syscall(SYS_sched_setattr, 0, &attributes, 0);
#else
  static_cast<void>(steps);
#endif
}

}  // namespace mono_pose_tracker
