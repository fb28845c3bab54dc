#include "result_choice.h"

#include <algorithm>
#include <vector>

#include "mapping/depth_reversal.h"

namespace mono_pose_tracker {

bool is_confirmed(const RecordingResult& result) { return result.tracked && result.maps.front().confirmed(); }

// Explained matches of an edge, times the images: a map of few landmarks explains few, if all that it has.
double score(const RecordingResult& result) {
  if (!result.tracked) return 0;
  const ExplainedMatches& matches = result.maps.front().explained;
  return static_cast<double>(result.trajectory.size()) * matches.explained / std::max(1, matches.edges);
}

bool is_better(const RecordingResult& result, const RecordingResult& before) {
  constexpr double kMargin = 1.01;  // of the score: below, the earlier result stays
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
