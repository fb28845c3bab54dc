#include "doubtful_frames.h"

#include <cmath>
#include <iterator>

#include "finished_maps.h"
#include "mono_pose_tracker/quality/quality_report.h"

namespace mono_pose_tracker {

std::set<std::int64_t> isolated_frames(const std::vector<RegisteredFrame>& trajectory,
                                       const DoubtfulFramesOptions& options) {
  const std::set<std::int64_t> registered = frames_of(trajectory);
  std::set<std::int64_t> isolated;
  for (const std::int64_t frame : registered) {
    const auto views = std::distance(registered.lower_bound(frame - options.near),
                                     registered.upper_bound(frame + options.near));
    if (views < 3) isolated.insert(frame);
  }
  return isolated;
}

std::vector<std::int64_t> doubtful_alone(const std::vector<RegisteredFrame>& trajectory,
                                         const std::set<std::int64_t>& doubtful) {
  const std::set<std::int64_t> registered = frames_of(trajectory);
  const auto is_sure = [&](std::int64_t frame) { return registered.count(frame) && !doubtful.count(frame); };
  std::vector<std::int64_t> alone;
  for (const std::int64_t frame : doubtful) {
    if (registered.count(frame) && !(is_sure(frame - 1) && is_sure(frame + 1))) alone.push_back(frame);
  }
  return alone;
}

bool may_distort_path(std::size_t doubtful, std::size_t registered, const DoubtfulFramesOptions& options) {
  if (registered == 0) return false;
  const auto n = static_cast<double>(registered), d = static_cast<double>(doubtful);
  // Relative to the path, of one step for each image: root mean square over all images.
  return d > options.most_share * n || options.steps / n * std::sqrt(d / n) > QualityOptions().max_path_sigma;
}

}  // namespace mono_pose_tracker
