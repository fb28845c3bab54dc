#include "mono_pose_tracker/common/thread_priority.h"

#ifdef __linux__
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

namespace mono_pose_tracker {

void lower_thread_priority(int steps) {
#ifdef __linux__
  // On Linux niceness is a thread's own. (POSIX says the process's.)
  const auto thread = static_cast<id_t>(syscall(SYS_gettid));
  setpriority(PRIO_PROCESS, thread, getpriority(PRIO_PROCESS, thread) + steps);
#else
  static_cast<void>(steps);
#endif
}

}  // namespace mono_pose_tracker
