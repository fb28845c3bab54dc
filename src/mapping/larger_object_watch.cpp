#include "mapping/larger_object_watch.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/formatted.h"
#include "mapping/independent_motion.h"
#include "mapping/second_motion.h"

namespace mono_pose_tracker {

namespace {

constexpr std::int64_t kPeriod = 400000000;  // ns: matching two images takes a hundredth of a second
// An object that passes the camera within a few seconds is not to be mapped.
constexpr std::size_t kPairs = 6;
constexpr std::ptrdiff_t kLeastOthers = 3;  // pairs that show it: by chance one in a hundred does
// As many points as the first map needs by default. This only raises a doubt and begins no map, so it does
// not follow bootstrap/min_landmarks.
constexpr std::int64_t kLeastMembers = 25;

}  // namespace

void LargerObjectWatch::ask(const Map& map, const MatchOptions& matching, const RansacOptions& ransac) {
  if (map.keyframes().size() < 2) return;
  const auto newest = std::prev(map.keyframes().end());
  if (!asked_.is_due(newest->second.stamp_ns, kPeriod)) return;
  const PairMotions pair = compare_motions(registered_image(std::prev(newest)->second),
                                           registered_image(newest->second), matching, ransac);
  const auto obeying = [&](ObeyedMotion motion) {
    return std::count(pair.obeyed.begin(), pair.obeyed.end(), motion);
  };
  Seen now{obeying(ObeyedMotion::kObject), obeying(ObeyedMotion::kOther)};
  if (!pair.has_other || now.of_other < kLeastMembers) now.of_other = 0;
  seen_.push_back(now);
  if (seen_.size() > kPairs) seen_.pop_front();
  Seen all;
  for (const Seen& seen : seen_) {
    all.of_map += seen.of_map;
    all.of_other += seen.of_other;
  }
  const auto others = std::count_if(seen_.begin(), seen_.end(), [](const Seen& s) { return s.of_other > 0; });
  const double share =
      static_cast<double>(all.of_other) / std::max<double>(1, static_cast<double>(all.of_map + all.of_other));
  doubt_ = others >= kLeastOthers && share > IndependentMotion::kLarger
               ? formatted("%ld %% of the points move as one rigid object, but not with the map",
                           std::lround(100 * share))
               : "";
}

}  // namespace mono_pose_tracker
