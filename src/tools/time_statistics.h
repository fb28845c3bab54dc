#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "json.h"
#include "study/statistics.h"

namespace mono_pose_tracker {

/// Median, 95th percentile, maximum and number of times in ms; all 0 of none.
inline Json time_statistics(std::vector<double> ms) {
  std::sort(ms.begin(), ms.end());
  return {{"median_ms", quantile_of_sorted(ms, 0.5)},
          {"p95_ms", quantile_of_sorted(ms, 0.95)},
          {"max_ms", ms.empty() ? 0 : ms.back()},
          {"count", ms.size()}};
}

inline Json time_statistics(const std::map<std::string, std::vector<double>>& stages) {
  Json json = Json::object();
  for (const auto& [stage, ms] : stages) json[stage] = time_statistics(ms);
  return json;
}

}  // namespace mono_pose_tracker
