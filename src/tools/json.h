#pragma once

#include <nlohmann/json.hpp>

namespace mono_pose_tracker {

/// Keys stand in the order in which they were set; sorted with a library before 3.9 (Ubuntu 20.04 has 3.7).
#if !defined(MONO_POSE_TRACKER_OLD_LIBRARIES) && \
    (NLOHMANN_JSON_VERSION_MAJOR > 3 ||          \
     (NLOHMANN_JSON_VERSION_MAJOR == 3 && NLOHMANN_JSON_VERSION_MINOR >= 9))
using Json = nlohmann::ordered_json;
#else
using Json = nlohmann::json;
#endif

}  // namespace mono_pose_tracker
