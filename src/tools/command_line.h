#pragma once

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

namespace mono_pose_tracker {

/// Parses and runs; run returns the exit status. What goes wrong is one line on standard error that names the
/// program, and status 2.
template <typename Run>
int run_command_line(const char* program, CLI::App& app, int argc, char** argv, const Run& run) {
  try {
    app.parse(argc, argv);
    return run();
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);
    std::fprintf(stderr, "%s: %s\n", program, e.what());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s: %s\n", program, e.what());
  }
  return 2;
}

}  // namespace mono_pose_tracker
