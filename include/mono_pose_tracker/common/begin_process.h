#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>

namespace mono_pose_tracker {

/// First thing in a program. Where standard input, output or error is closed, the first file that is opened
/// would take its place, and what is printed go into it: the null device is there instead, of which what is
/// closed to write to can only be read, so that printing still fails. A file that grows beyond its limit
/// (ulimit -f) is an error that is told, as a full disk is, and not the end of the process.
inline void begin_process() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(descriptor, F_GETFD) >= 0 || errno != EBADF) continue;
    // The lowest that is free, which is this one.
    static_cast<void>(open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY));
  }
  std::signal(SIGXFSZ, SIG_IGN);
}

}  // namespace mono_pose_tracker
