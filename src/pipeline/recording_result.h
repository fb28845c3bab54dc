#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "mapping/loop_closer.h"
#include "mono_pose_tracker/tracking/frame_report.h"
#include "tracking/finished_map.h"

namespace mono_pose_tracker {

/// What is known of a recording in the end: poses, maps, findings about them.
struct RecordingResult {
  bool tracked = false;  // there is a map; otherwise `reason` has the cause
  std::string reason;
  std::int64_t frames_total = 0;                 // images that could be read
  std::int64_t frames_with_features = 0;         // of these: neither black nor of another size
  std::set<std::int64_t> unreadable;             // images skipped, counted with those that could be read
  std::vector<std::string> problems;             // one line for each image skipped or mask missing
  std::vector<std::string> warnings;             // why the result is doubtful and what to do
  std::optional<std::string> calibration_doubt;  // by Recording::calibration_test, where it was made
  std::map<std::int64_t, std::string> names;     // of the images, by frame index
  std::vector<RegisteredFrame> trajectory;       // after the last optimisation, by index
  /// All maps that could not be merged and in which a frame is registered. `trajectory` is that of the first.
  std::vector<FinishedMap> maps;
  std::vector<ClosedLoop> loops;  // in any of the maps
  std::int64_t frames_posed_live = 0;
  std::set<std::int64_t> doubtful;  // frames of these: DOUBTFUL_POSE; FinishedMap has those of each map
  int failed_adjustments = 0;       // rejected bundle adjustments
  std::map<std::string, std::vector<double>> stage_ms;
};

/// The verdict on the first map.
bool is_confirmed(const RecordingResult& result);

/// Whether the map has two views that no third confirmed.
bool rests_on_two_views(const RecordingResult& result);

/// A finding about all maps of the result, such as one about the calibration; it becomes a warning.
void add_finding(FindingKind kind, const std::string& text, bool is_disqualifying, RecordingResult* result);

struct RecordingFindingsOptions {
  /// Images of a map other than the first; one with fewer is not confirmed. The reason for its separation is
  /// unknown, and inconsistencies hardly show in so few images: maps of ten to sixteen images without any
  /// finding were 5 to 9 % off; none of twenty or more was.
  std::size_t least_outside_first = 20;
  double most_unregistered = 0.1;  // share of the images: fewer are usual, as every recording has some
                                   // blurred images
  std::size_t listed_images = 10;  // in a message
  double doubtful_steps = 3;       // error of a doubtful pose, in steps between images. An estimate: measured
                                   // wrong poses had one to three
  double most_doubtful = 0.25;     // share of all frames: consecutive doubtful poses propagate their error
};

/// Completes the reports of the result's maps by findings about the whole recording: motions, separate maps,
/// images without a pose or with an uncertain one. Every finding becomes a warning.
void add_findings(RecordingResult* result);

struct ResultChoiceOptions {
  double matches_per_edge = 100;  // for full weight: four times the minimum. A map of few landmarks may
                                  // explain all of its matches
  double margin = 1.01;           // minimum ratio of scores for the later result
  double min_share = 0.75;        // of the images of another result, for about as many
};

/// Whether the result replaces the previous one. A confirmed result replaces an unconfirmed one that does not
/// have far more images. Otherwise the score must be higher by a margin: the number of images registered in
/// the first map, times the share of the view graph's verified matches that it explains.
bool is_better(const RecordingResult& result, const RecordingResult& before);

/// Nothing disqualifies the result, except that another object may be the wanted one.
bool is_right_of_its_object(const RecordingResult& result);

/// Whether an object's map is in several parts.
bool fell_apart(const RecordingResult& result);

/// Whether the result has about as many images, or more.
bool is_most_of(const RecordingResult& result, const RecordingResult& before);

// Frames, by index.

std::set<std::int64_t> frames_of(const std::vector<RegisteredFrame>& trajectory);

/// The frames of a recording of this length that are not in `registered`.
std::set<std::int64_t> frames_without_pose(const std::set<std::int64_t>& registered,
                                           std::int64_t frames_total);

/// Frames that are doubtful in the result or in one of its maps.
std::set<std::int64_t> doubtful_frames(const RecordingResult& result);

/// At most `most` of the frames: those nearest to a registered one; of equals, the earlier ones.
std::set<std::int64_t> nearest_to_registered(const std::set<std::int64_t>& frames,
                                             const std::set<std::int64_t>& registered, std::size_t most);

/// Removes maps that were begun while the camera was lost and whose frames all have a pose in the first map.
/// Loaded maps stay.
void exclude_covered_maps(std::vector<FinishedMap>* maps);

/// Frames of the trajectory with doubtful poses, without those between two certain poses: their errors are
/// small, or they were detected as outliers.
std::vector<std::int64_t> doubtful_alone(const std::vector<RegisteredFrame>& trajectory,
                                         const std::set<std::int64_t>& doubtful);

/// Whether this number of doubtful poses may distort the path by more than the uncertainty of a known path
/// (quality/path_precision.h).
bool may_distort_path(std::size_t doubtful, std::size_t registered);

}  // namespace mono_pose_tracker
