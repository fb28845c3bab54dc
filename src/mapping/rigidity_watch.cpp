#include "mapping/rigidity_watch.h"

#include "common/formatted.h"
#include "mapping/reprojection_inconsistency.h"
#include "mapping/rigidity_check.h"

namespace mono_pose_tracker {

namespace {

constexpr std::int64_t kPeriod = 1000000000;  // ns
// Of a test once a second: one false alarm in ten days.
constexpr double kSignificance = 1e-6;

std::string doubt_about(const Map& map, const MatchOptions& matching) {
  const ReprojectionInconsistency contradiction = newest_inconsistency(map, matching);
  if (contradiction.p_value() < kSignificance) {
    return formatted("%d of %d points are observed away from their position in the map",
                     contradiction.contradicting, contradiction.matches);
  }
  RigidityOptions options;
  options.newest = options.stretch;
  options.significance = kSignificance;
  const RigidityReport rigidity = check_rigidity(map, options);
  if (rigidity.is_rigid) return "";
  return formatted("the poses from the %s landmarks differ by %.1f px", rigidity.parts.c_str(),
                   rigidity.disagreement_px);
}

}  // namespace

void RigidityWatch::ask(const Map& map, const MatchOptions& matching) {
  if (map.keyframes().empty()) return;
  if (!asked_.is_due(map.keyframes().rbegin()->second.stamp_ns, kPeriod)) return;
  doubt_ = doubt_about(map, matching);
}

}  // namespace mono_pose_tracker
