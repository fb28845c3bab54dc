#include "finished_maps.h"

#include <algorithm>

#include "mono_pose_tracker/mapping/depth_reversal.h"

namespace mono_pose_tracker {

std::set<std::int64_t> frames_of(const std::vector<PosedFrame>& trajectory) {
  std::set<std::int64_t> frames;
  for (const PosedFrame& frame : trajectory) frames.insert(frame.index);
  return frames;
}

bool is_loaded(const FinishedMap& map) {
  const auto& keyframes = map.map.keyframes();
  return !keyframes.empty() && is_of_earlier_run(keyframes.begin()->second.frame_index);
}

std::size_t frames_beside_first(const std::vector<FinishedMap>& maps) {
  if (maps.empty()) return 0;
  std::set<std::int64_t> beside;
  for (auto map = maps.begin() + 1; map != maps.end(); ++map) beside.merge(frames_of(map->trajectory));
  for (const std::int64_t frame : frames_of(maps.front().trajectory)) beside.erase(frame);
  return beside.size();
}

void leave_out_covered_maps(std::vector<FinishedMap>* maps) {
  if (maps->empty()) return;
  const std::set<std::int64_t> in_first = frames_of(maps->front().trajectory);
  const auto is_covered = [&](const FinishedMap& map) {
    const std::set<std::int64_t> frames = frames_of(map.trajectory);
    return !is_loaded(map) && std::includes(in_first.begin(), in_first.end(), frames.begin(), frames.end());
  };
  maps->erase(std::remove_if(maps->begin() + 1, maps->end(), is_covered), maps->end());
}

double share_held(const FinishedMap& first, std::int64_t images) {
  if (images == 0 || is_loaded(first) || is_narrow(first.map)) return 1;
  return static_cast<double>(first.trajectory.size()) / static_cast<double>(images);
}

void doubt_parts(std::int64_t images, std::vector<FinishedMap>* maps) {
  constexpr double kLeast = 2.0 / 3;
  if (maps->empty() || share_held(maps->front(), images) >= kLeast) return;
  maps->front().holds_little = true;
  for (FinishedMap& map : *maps) {
    if (!is_loaded(map)) map.confirmed = false;
  }
}

void doubt_few_images(std::vector<FinishedMap>* maps) {
  for (std::size_t i = 1; i < maps->size(); ++i) {
    FinishedMap& map = (*maps)[i];
    if (!is_loaded(map) && map.trajectory.size() < kLeastBesideFirst) map.confirmed = false;
  }
}

}  // namespace mono_pose_tracker
