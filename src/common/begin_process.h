#pragma once

#include <fcntl.h>
#include <unistd.h>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <cerrno>
#include <csignal>
#include <initializer_list>

namespace mono_pose_tracker {

/// To be called first in a program. Where standard input, output or error is closed, the first file opened
/// would take its place, and get what is printed: /dev/null is opened there instead, in the wrong direction
/// (stdin for writing, the others for reading), so that using a closed stream still fails. A file that grows
/// beyond its limit (ulimit -f) is reported as an error, as a full disk is, instead of ending the process.
/// Freed memory is kept for what is asked for next, as each page that is given back and asked for again costs
/// a fault. Blocks of 4 MB and more, such as planes of a scale space, are given back: small blocks that are
/// kept for long would settle in them, and the heap would grow to several times what is in use.
inline void begin_process() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(descriptor, F_GETFD) >= 0 || errno != EBADF) continue;
    // The lowest that is free, which is this one.
    static_cast<void>(open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY));
  }
  std::signal(SIGXFSZ, SIG_IGN);
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 4 << 20);
  mallopt(M_TRIM_THRESHOLD, 64 << 20);
#endif
}

}  // namespace mono_pose_tracker
