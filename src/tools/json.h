#pragma once

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/statistics.h"

namespace mono_pose_tracker {

/// Keys stand in the order in which they were set; sorted with a library before 3.9 (Ubuntu 20.04 has 3.7).
#if !defined(MONO_POSE_TRACKER_OLD_LIBRARIES) && \
    (NLOHMANN_JSON_VERSION_MAJOR > 3 ||          \
     (NLOHMANN_JSON_VERSION_MAJOR == 3 && NLOHMANN_JSON_VERSION_MINOR >= 9))
using Json = nlohmann::ordered_json;
#else
using Json = nlohmann::json;
#endif

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
