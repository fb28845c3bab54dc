#include "result_choice.h"

#include <algorithm>
#include <vector>

#include "mapping/depth_reversal.h"

namespace mono_pose_tracker {

bool is_confirmed(const RecordingResult& result) { return result.tracked && result.maps.front().confirmed(); }

// Edges with few matches have less weight.
double score(const RecordingResult& result, const ResultChoiceOptions& options) {
  if (!result.tracked) return 0;
  const ExplainedMatches& matches = result.maps.front().explained;
  const double per_edge =
      matches.edges > 0 ? static_cast<double>(matches.explained) / matches.edges : options.matches_per_edge;
  return static_cast<double>(result.trajectory.size()) * matches.share() *
         std::min(1.0, per_edge / options.matches_per_edge);
}

bool is_better(const RecordingResult& result, const RecordingResult& before,
               const ResultChoiceOptions& options) {
  if (!result.tracked || !before.tracked) return result.tracked && !before.tracked;
  if (is_confirmed(result) != is_confirmed(before)) {
    return is_confirmed(result) ? is_most_of(result, before, options) : !is_most_of(before, result, options);
  }
  return score(result, options) > options.margin * score(before, options);
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

bool is_most_of(const RecordingResult& result, const RecordingResult& before,
                const ResultChoiceOptions& options) {
  return static_cast<double>(result.trajectory.size()) >=
         options.min_share * static_cast<double>(before.trajectory.size());
}

}  // namespace mono_pose_tracker
