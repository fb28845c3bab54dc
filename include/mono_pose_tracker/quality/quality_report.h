#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace mono_pose_tracker {

class Map;
struct PathPrecision;
class ViewGraph;

/// Findings about a map: evidence against it, or information on it.
enum class FindingKind {
  kInconsistentSegment,  // images elsewhere than the view graph's matches say
  kUncertainScale,       // lengths before and after a moment
  kUncertainPath,        // positions of the keyframes
  kDepthReversal,        // an alternative hypothesis explains the images about as well
  kPlanarAmbiguity,
  kOtherObject,  // another rigid object may be the one that is wanted
  kStaticBackground,
  kTwoViews,   // no third image has confirmed the map
  kFewImages,  // of the recording are in the map
  kSeveralMaps,
  kUnregisteredImages,
  kUncertainImages,
  kCalibration,
};
/// Snake case, as in report.json.
const char* to_string(FindingKind kind);

struct Finding {
  FindingKind kind = FindingKind::kCalibration;
  std::vector<std::int64_t> images;  // frame indices concerned; empty: all
  int k = 0, n = 0;                  // k of n matches, landmarks or images; 0 of 0: not counted
  std::optional<double> p_value;     // of the test; of an alternative: that it is no worse than the
                                     // map. None: not a test
  bool is_disqualifying = true;      // the map is not confirmed
  std::string text;                  // what was found, how bad, what to do; one line
};

/// All findings about one map, and the verdict. Made once, when a recording ends.
class QualityReport {
 public:
  void add(Finding finding) { findings_.push_back(std::move(finding)); }
  /// The new finding, to be completed; valid until the next one.
  Finding& add(FindingKind kind, std::string text);
  const std::vector<Finding>& findings() const { return findings_; }
  /// No finding is disqualifying: poses and map are right to QualityOptions::max_path_sigma.
  bool confirmed() const;
  bool has(FindingKind kind) const;

 private:
  std::vector<Finding> findings_;
};

struct QualityOptions {
  double significance = 1e-3;  // of the consistency tests: expected false alarms a recording, so 1 in 1,000;
                               // and at which alternatives are ruled out
  double max_path_sigma = 0.01;     // standard deviation of positions, share of the path: three are 3 %
  double max_extent_sigma = 0.2;    // the same, share of the keyframes' extent: noise makes the path of a
                                    // camera at rest long
  double min_registered = 2.0 / 3;  // share of the images that the first map must hold to be confirmed
};

/// Input of the tests: data of a finished map. Images are counted by frame index.
struct MapEvidence {
  const Map* map = nullptr;
  const ViewGraph* graph = nullptr;     // null: no consistency test
  const PathPrecision* path = nullptr;  // null: no test of its uncertainty
  std::string name;                     // "" for the first map, else such as "map_2"
  bool is_first = true;
  bool is_loaded = false;  // it comes from a file: nothing is asked of its path
  bool rests_on_two_views = false;
  bool is_object = false;      // a narrow view: images that do not show the object are no loss
  std::size_t registered = 0;  // images
  std::int64_t images = 0;     // that have features
  // That an alternative explains the images so much worse by chance (mapping/depth_reversal.h,
  // planar_ambiguity.h).
  double reversal_p_value = 0, planar_p_value = 0;
};

/// The tests of one map: consistency with the view graph, uncertainty of its scale and path, alternative
/// hypotheses, missing images.
QualityReport assess(const MapEvidence& evidence, const QualityOptions& options);

/// Verified matches of the graph that agree with the map, and all between its keyframes.
struct ExplainedMatches {
  int explained = 0, all = 0;
  int edges = 0;  // that hold them
  double share() const { return all > 0 ? static_cast<double>(explained) / all : 1; }
};
ExplainedMatches explained_matches(const Map& map, const ViewGraph& graph);

}  // namespace mono_pose_tracker
