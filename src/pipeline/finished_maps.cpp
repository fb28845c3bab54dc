#include "finished_maps.h"

#include <algorithm>

namespace mono_pose_tracker {

std::set<std::int64_t> frames_of(const std::vector<RegisteredFrame>& trajectory) {
  std::set<std::int64_t> frames;
  for (const RegisteredFrame& frame : trajectory) frames.insert(frame.index);
  return frames;
}

std::size_t frames_outside_first(const std::vector<FinishedMap>& maps) {
  if (maps.empty()) return 0;
  std::set<std::int64_t> outside;
  for (auto map = maps.begin() + 1; map != maps.end(); ++map) outside.merge(frames_of(map->trajectory));
  for (const std::int64_t frame : frames_of(maps.front().trajectory)) outside.erase(frame);
  return outside.size();
}

void exclude_covered_maps(std::vector<FinishedMap>* maps) {
  if (maps->empty()) return;
  const std::set<std::int64_t> in_first = frames_of(maps->front().trajectory);
  const auto is_covered = [&](const FinishedMap& map) {
    const std::set<std::int64_t> frames = frames_of(map.trajectory);
    return !map.is_loaded() && std::includes(in_first.begin(), in_first.end(), frames.begin(), frames.end());
  };
  maps->erase(std::remove_if(maps->begin() + 1, maps->end(), is_covered), maps->end());
}

}  // namespace mono_pose_tracker
