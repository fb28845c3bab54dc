#pragma once

#include <CLI/CLI.hpp>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/begin_process.h"
#include "common/text.h"

namespace mono_pose_tracker {

/// Accepts whole decimal numbers from `least` on. Without it -1 would be the largest number, and 0100 be 64.
inline CLI::Validator whole_number(std::uint64_t least) {
  const std::string expected = "expected a whole number of at least " + std::to_string(least);
  return CLI::Validator(
      [=](const std::string& text) {
        std::uint64_t value = 0;
        return parse_decimal(text, &value) && value >= least ? std::string() : text + ": " + expected;
      },
      "", "whole number");
}

/// Accepts decimal numbers in the range, and no other text: to CLI::Range nan is in every range.
inline CLI::Validator number_between(double least, double most) {
  std::ostringstream range;
  range << least << " to " << most;
  return CLI::Validator(
      [=, expected = ": expected a number from " + range.str()](const std::string& text) {
        double value = 0;
        return parse_decimal(text, &value) && value >= least && value <= most ? std::string()
                                                                              : text + expected;
      },
      "in " + range.str(), "number in range");
}

/// For programs whose result is printed: throws when it could not be written, for example on a full disk.
inline void require_printed() {
  errno = 0;
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return;
  throw std::runtime_error("standard output: cannot be written (" + system_error_text() + ")");
}

/// Rejects an option with an empty value, most likely an unset variable of a script.
inline void refuse_empty_texts(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& text : option->results()) {
      if (text.empty()) throw CLI::ValidationError(option->get_name(), "is empty");
    }
  }
}

/// Parses and runs; run returns the exit status. An error prints one line on standard error that names the
/// program; the status is then 2.
template <typename Run>
int run_command_line(const char* program, CLI::App& app, int argc, char** argv, const Run& run) {
  begin_process();
  try {
    app.parse(argc, argv);
    refuse_empty_texts(app);
    return run();
  } catch (const CLI::RequiredError& e) {
    // A missing option may have been misspelt.
    const std::vector<std::string> unknown = app.remaining();
    std::fprintf(
        stderr, "%s: %s\n", program,
        one_line(unknown.empty() ? e.what() : unknown.front() + " is not an option; " + e.what()).c_str());
  } catch (const CLI::ExtrasError&) {
    std::fprintf(stderr, "%s: %s is not an option: expected one of those that --help lists\n", program,
                 one_line(app.remaining().front()).c_str());
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);
    std::fprintf(stderr, "%s: %s\n", program, one_line(e.what()).c_str());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s: %s\n", program, one_line(e.what()).c_str());
  }
  return 2;
}

/// Number of termination signals, and the last of them. Written by the handler, read by any thread.
inline std::atomic<int> signals_caught{0}, last_signal{0};
static_assert(std::atomic<int>::is_always_lock_free, "a handler may use no lock");

/// The next SIGINT or SIGTERM is counted; another one of either ends the program at once.
inline void end_on_signals() {
  for (const int signal : {SIGINT, SIGTERM}) {
    std::signal(signal, [](int caught) {
      last_signal = caught;
      ++signals_caught;
      std::signal(SIGINT, SIG_DFL);
      std::signal(SIGTERM, SIG_DFL);
    });
  }
}

/// Exit status as a shell reports it.
inline int end_status(int otherwise) { return signals_caught > 0 ? 128 + last_signal : otherwise; }

}  // namespace mono_pose_tracker
