#pragma once

#include <string>

#include "tools/json.h"

namespace mono_pose_tracker {

/// The result of a benchmark as a table for people, times in ms.
std::string benchmark_table(const Json& result);

/// Reads what --json wrote. Throws std::runtime_error, one line naming the file, when it is no such thing.
Json read_benchmark(const std::string& path);

/// Every figure that both have: earlier, now, and now / earlier.
std::string comparison_table(const Json& earlier, const Json& now);

}  // namespace mono_pose_tracker
