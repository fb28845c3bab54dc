#pragma once

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "../study/statistics.h"

namespace mono_pose_tracker {

/// Median, 95th percentile, maximum and number of times in ms; all 0 of none.
inline nlohmann::ordered_json time_statistics(std::vector<double> ms) {
  std::sort(ms.begin(), ms.end());
  return {{"median_ms", quantile_of_sorted(ms, 0.5)},
          {"p95_ms", quantile_of_sorted(ms, 0.95)},
          {"max_ms", ms.empty() ? 0 : ms.back()},
          {"count", ms.size()}};
}

inline nlohmann::ordered_json time_statistics(const std::map<std::string, std::vector<double>>& stages) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const auto& [stage, ms] : stages) json[stage] = time_statistics(ms);
  return json;
}

}  // namespace mono_pose_tracker
