#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace mono_pose_tracker {

/// The result of a benchmark as a table for people, times in ms.
std::string benchmark_table(const nlohmann::ordered_json& result);

/// Reads what --json wrote. Throws std::runtime_error, one line naming the file, when it is no such thing.
nlohmann::ordered_json read_benchmark(const std::string& path);

/// Every figure that both have: earlier, now, and now / earlier.
std::string comparison_table(const nlohmann::ordered_json& earlier, const nlohmann::ordered_json& now);

}  // namespace mono_pose_tracker
