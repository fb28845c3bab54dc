#include "result_choice.h"

#include <algorithm>
#include <vector>

#include "mapping/depth_reversal.h"

namespace mono_pose_tracker {

bool is_confirmed(const RecordingResult& result) { return result.tracked && result.maps.front().confirmed(); }

// A map of few landmarks may explain all of its matches: edges with few matches have less weight.
double score(const RecordingResult& result) {
  constexpr double kEnough = 100;  // matches of an edge for full weight: four times the minimum
  if (!result.tracked) return 0;
  const ExplainedMatches& matches = result.maps.front().explained;
  const double per_edge =
      matches.edges > 0 ? static_cast<double>(matches.explained) / matches.edges : kEnough;
  return static_cast<double>(result.trajectory.size()) * matches.share() * std::min(1.0, per_edge / kEnough);
}

bool is_better(const RecordingResult& result, const RecordingResult& before) {
  constexpr double kMargin = 1.01;  // minimum ratio of scores for the later result
  if (!result.tracked || !before.tracked) return result.tracked && !before.tracked;
  if (is_confirmed(result) != is_confirmed(before)) {
    return is_confirmed(result) ? is_most_of(result, before) : !is_most_of(before, result);
  }
  return score(result) > kMargin * score(before);
}

bool is_right_of_its_object(const RecordingResult& result) {
  if (!result.tracked) return false;
  const std::vector<Finding>& findings = result.maps.front().quality.findings();
  return std::all_of(findings.begin(), findings.end(), [](const Finding& finding) {
    return !finding.is_disqualifying || finding.kind == FindingKind::kOtherObject;
  });
}

bool fell_apart(const RecordingResult& result) {
  return result.maps.size() > 1 && is_narrow(result.maps.front().map);
}

bool is_most_of(const RecordingResult& result, const RecordingResult& before) {
  constexpr double kMinShare = 0.75;
  return static_cast<double>(result.trajectory.size()) >=
         kMinShare * static_cast<double>(before.trajectory.size());
}

}  // namespace mono_pose_tracker
