#include "unregistered_frames.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

namespace mono_pose_tracker {

namespace {

std::int64_t distance_to(const std::set<std::int64_t>& registered, std::int64_t frame) {
  std::int64_t distance = std::numeric_limits<std::int64_t>::max();
  const auto after = registered.lower_bound(frame);
  if (after != registered.end()) distance = *after - frame;
  if (after != registered.begin()) distance = std::min(distance, frame - *std::prev(after));
  return distance;
}

}  // namespace

std::set<std::int64_t> frames_without_pose(const std::set<std::int64_t>& registered,
                                           std::int64_t frames_total) {
  std::set<std::int64_t> without;
  for (std::int64_t frame = 0; frame < frames_total; ++frame) {
    if (registered.count(frame) == 0) without.insert(frame);
  }
  return without;
}

std::set<std::int64_t> nearest_to_registered(const std::set<std::int64_t>& frames,
                                             const std::set<std::int64_t>& registered, std::size_t most) {
  std::vector<std::pair<std::int64_t, std::int64_t>> by_distance;
  by_distance.reserve(frames.size());
  for (const std::int64_t frame : frames) by_distance.emplace_back(distance_to(registered, frame), frame);
  std::sort(by_distance.begin(), by_distance.end());
  if (by_distance.size() > most) by_distance.resize(most);
  std::set<std::int64_t> nearest;
  for (const auto& entry : by_distance) nearest.insert(entry.second);
  return nearest;
}

}  // namespace mono_pose_tracker
