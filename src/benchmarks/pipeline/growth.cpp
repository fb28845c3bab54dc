#include "growth.h"

#include <algorithm>
#include <cstdio>

#include "process_usage.h"
#include "simulation/growth_study.h"

namespace mono_pose_tracker {
namespace {

constexpr int kFinishUpTo = 1600;  // keyframes

// 100, 200, 400, ...
std::vector<int> sizes_up_to(int most) {
  std::vector<int> sizes;
  for (int size = 100; size <= most; size *= 2) sizes.push_back(size);
  return sizes;
}

Json grow(const FeatureWalk& walk, const std::vector<int>& sizes, const TrackerOptions& options) {
  const double memory_before = resident_mb();
  Json steps = Json::array();
  for (const GrowthStep& step : run_growth_study(walk, walk_camera(), options, sizes, kFinishUpTo)) {
    steps.push_back({{"keyframes", step.keyframes},
                     {"landmarks", step.landmarks},
                     {"keyframe_ms", step.keyframe_ms},
                     {"publish_ms", step.publish_ms},
                     {"finish_s", step.finish_s},
                     {"global_adjust_s", step.global_adjust_s}});
  }
  const double memory = peak_resident_mb() - memory_before;
  return {{"steps", steps}, {"mb_per_keyframe", memory / sizes.back()}};
}

}  // namespace

Json run_growth(int most_keyframes, const TrackerOptions& options) {
  // Frames to spare: not each becomes a keyframe.
  const std::vector<int> street = sizes_up_to(most_keyframes),
                         wall = sizes_up_to(std::max(100, most_keyframes / 4));
  const auto frames = [](const std::vector<int>& sizes) { return sizes.back() + sizes.back() / 10 + 10; };
  Json result;
  result["street"] = grow(street_walk(options.seed, frames(street)), street, options);
  result["wall"] = grow(wall_walk(options.seed, frames(wall)), wall, options);
  return result;
}

std::string growth_table(const Json& growth) {
  std::string table;
  char line[200];
  for (const auto& [scene, result] : growth.items()) {
    table += scene + "\nkeyframes  landmarks  ms a keyframe  snapshot ms  finish s  global adjustment s\n";
    for (const Json& step : result["steps"]) {
      std::snprintf(line, sizeof line, "%9d  %9d  %13.1f  %11.2f  %8.2f  %19.2f\n",
                    step["keyframes"].get<int>(), step["landmarks"].get<int>(),
                    step["keyframe_ms"].get<double>(), step["publish_ms"].get<double>(),
                    step["finish_s"].get<double>(), step["global_adjust_s"].get<double>());
      table += line;
    }
    std::snprintf(line, sizeof line, "%.2f MB a keyframe\n", result["mb_per_keyframe"].get<double>());
    table += line;
  }
  return table;
}

}  // namespace mono_pose_tracker
