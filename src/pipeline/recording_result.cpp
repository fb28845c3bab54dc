#include "pipeline/recording_result.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "common/text.h"
#include "mapping/depth_reversal.h"
#include "mono_pose_tracker/quality/quality_report.h"

namespace mono_pose_tracker {

namespace {

constexpr RecordingFindingsOptions kFindings{};
constexpr ResultChoiceOptions kChoice{};

std::string name_of(std::size_t map) { return map == 0 ? "" : "map_" + std::to_string(map + 1) + ": "; }

// k of n images.
Finding finding_of(FindingKind kind, std::string text, bool is_disqualifying = true, std::size_t k = 0,
                   std::size_t n = 0, std::vector<std::int64_t> images = {}) {
  return {kind,         std::move(images), static_cast<int>(k), static_cast<int>(n),
          std::nullopt, is_disqualifying,  std::move(text)};
}

// %ld: share of the matches that move with the other object, per cent.
const char* text_about(OtherObject other) {
  switch (other) {
    case OtherObject::kMayBeTurning:
      return "Two rigid objects move, and it is not clear whether the map is of the turning one "
             "(segmentation/body): %ld %% of the matches move with the other. Mask the one that is wanted "
             "(--masks).";
    case OtherObject::kLarger:
      return "Two rigid objects move, and the map is of the smaller: %ld %% of the matches move with the "
             "other. Mask the one that is wanted (--masks).";
    case OtherObject::kComparable:
      return "A second rigid motion explains %ld %% of the matches: another object, or the near part of the "
             "map is wrong. Mask the object that is wanted (--masks), or use segmentation/body: turning "
             "(config/object.yaml).";
    case OtherObject::kRotatesMore:
      return "A smaller object rotates more than the mapped one: %ld %% of the matches move with it. If it "
             "is wanted, mask it (--masks), or use segmentation/body: turning (config/object.yaml).";
    case OtherObject::kNone:
      break;
  }
  return nullptr;
}

void report_objects(FinishedMap* map) {
  if (const char* const text = text_about(map->other_object)) {
    map->quality.add(finding_of(FindingKind::kOtherObject,
                                formatted(text, std::lround(100 * map->independent_motion.share()))));
  }
  if (!map->shows_background) return;
  map->quality.add(finding_of(FindingKind::kStaticBackground,
                              "An object moves in front of a static background, and the map may contain "
                              "both. Mask the object (--masks)."));
}

std::string some_of(const std::vector<std::int64_t>& frames) {
  const std::size_t most = kFindings.listed_images;
  std::string numbers;
  for (std::size_t i = 0; i < frames.size() && i < most; ++i) {
    numbers += (i == 0 ? "" : ", ") + std::to_string(frames[i]);
  }
  return frames.size() > most ? numbers + ", ..." : numbers;
}

// doubtful: of the recording.
std::set<std::int64_t> doubtful_in(const FinishedMap& map, const std::set<std::int64_t>& doubtful) {
  std::set<std::int64_t> frames;
  for (const RegisteredFrame& frame : map.trajectory) {
    if (doubtful.count(frame.index) > 0) frames.insert(frame.index);
  }
  return frames;
}

void report_uncertain_images(std::size_t place, FinishedMap* map) {
  const std::vector<std::int64_t> alone = doubtful_alone(map->trajectory, map->doubtful);
  const std::size_t k = alone.size(), n = map->trajectory.size();
  if (k == 0) return;
  const std::string text = formatted(
      "The poses of %zu of %zu images are uncertain (%s): few landmarks, or far from the predicted motion. "
      "Exclude these images where a wrong pose matters.",
      k, n, some_of(alone).c_str());
  map->quality.add(
      finding_of(FindingKind::kUncertainImages, name_of(place) + text, may_distort_path(k, n), k, n, alone));
}

// A small map other than the first has too few images to be checked.
void report_small_map(std::size_t place, FinishedMap* map) {
  const std::size_t k = map->trajectory.size(), n = kFindings.least_outside_first;
  if (place == 0 || map->is_loaded() || k >= n) return;
  const std::string text =
      formatted("The map has only %zu images; a map other than the first needs %zu to be confirmed.", k, n);
  map->quality.add(finding_of(FindingKind::kFewImages, name_of(place) + text, true, k, n));
}

std::set<std::int64_t> registered_frames(const std::vector<FinishedMap>& maps) {
  std::set<std::int64_t> registered;
  for (const FinishedMap& map : maps) registered.merge(frames_of(map.trajectory));
  return registered;
}

void report_several_maps(RecordingResult* result) {
  if (result->maps.size() < 2) return;
  const std::size_t k =
      registered_frames(result->maps).size() - frames_of(result->maps.front().trajectory).size();
  const std::string text = formatted(
      "The recording is in %zu maps that share no matches; %zu images are not in the first. "
      "Each map has its own frame and unit (map_2, ...). Record more overlap.",
      result->maps.size(), k);
  result->maps.front().quality.add(
      finding_of(FindingKind::kSeveralMaps, text, false, k, static_cast<std::size_t>(result->frames_total)));
}

// Missing images are easily overlooked in a trajectory.
void report_unregistered(RecordingResult* result) {
  const std::set<std::int64_t> without =
      frames_without_pose(registered_frames(result->maps), result->frames_total);
  if (static_cast<double>(without.size()) <=
      kFindings.most_unregistered * static_cast<double>(result->frames_total))
    return;
  long run = 0, longest = 0, last = -1;
  for (const std::int64_t frame : without) {
    run = without.count(frame - 1) > 0 ? run + 1 : 1;
    if (run > longest) longest = run, last = frame;
  }
  const auto k = without.size(), n = static_cast<std::size_t>(result->frames_total);
  std::string text = formatted("%zu of %zu images have no pose, the longest gap is from %ld to %ld: ", k, n,
                               last - longest + 1, last);
  const std::int64_t unusable = result->frames_total - result->frames_with_features;
  if (unusable >= static_cast<std::int64_t>(k)) {
    text += "these images have no features, or not the size of the calibration.";
  } else if (unusable > 0) {
    text += formatted(
        "%ld of these have no features, or not the size of the calibration; the rest are dark or blurred, or "
        "overlap too little.",
        static_cast<long>(unusable));
  } else {
    text += "dark, blurred, or too little overlap with the others.";
  }
  result->maps.front().quality.add(finding_of(FindingKind::kUnregisteredImages, std::move(text), false, k, n,
                                              {without.begin(), without.end()}));
}

// The cause of a gap in the first map may distort the other maps as well.
void spread_few_images(RecordingResult* result) {
  for (const Finding& finding : std::vector<Finding>(result->maps.front().quality.findings())) {
    if (finding.kind != FindingKind::kFewImages) continue;
    for (std::size_t i = 1; i < result->maps.size(); ++i) {
      if (!result->maps[i].is_loaded()) result->maps[i].quality.add(finding);
    }
  }
}

// The number of images registered in the first map, times the share of the view graph's verified matches that
// it explains: the only score by which results are compared. Edges with few matches have less weight.
double score(const RecordingResult& result) {
  const ExplainedMatches& matches = result.maps.front().explained;
  const double per_edge =
      matches.edges > 0 ? static_cast<double>(matches.explained) / matches.edges : kChoice.matches_per_edge;
  return static_cast<double>(result.trajectory.size()) * matches.share() *
         std::min(1.0, per_edge / kChoice.matches_per_edge);
}

std::int64_t distance_to(const std::set<std::int64_t>& registered, std::int64_t frame) {
  std::int64_t distance = std::numeric_limits<std::int64_t>::max();
  const auto after = registered.lower_bound(frame);
  if (after != registered.end()) distance = *after - frame;
  if (after != registered.begin()) distance = std::min(distance, frame - *std::prev(after));
  return distance;
}

}  // namespace

bool is_confirmed(const RecordingResult& result) { return result.tracked && result.maps.front().confirmed(); }

bool rests_on_two_views(const RecordingResult& result) {
  return result.tracked && result.maps.front().quality.has(FindingKind::kTwoViews);
}

void add_finding(FindingKind kind, const std::string& text, bool is_disqualifying, RecordingResult* result) {
  result->warnings.push_back(text);
  for (FinishedMap& map : result->maps) map.quality.add(finding_of(kind, text, is_disqualifying));
}

std::set<std::int64_t> doubtful_frames(const RecordingResult& result) {
  std::set<std::int64_t> doubtful = result.doubtful;
  for (const FinishedMap& map : result.maps) doubtful.insert(map.doubtful.begin(), map.doubtful.end());
  return doubtful;
}

void add_findings(RecordingResult* result) {
  std::vector<FinishedMap>& maps = result->maps;
  spread_few_images(result);
  for (std::size_t i = 0; i < maps.size(); ++i) {
    maps[i].doubtful = doubtful_in(maps[i], result->doubtful);
    report_uncertain_images(i, &maps[i]);
    report_small_map(i, &maps[i]);
  }
  report_objects(&maps.front());
  report_several_maps(result);
  report_unregistered(result);
  std::set<std::string> known;
  for (std::size_t i = 0; i < maps.size(); ++i) {
    for (const Finding& finding : maps[i].quality.findings()) {
      const bool is_reported = i == 0 || finding.is_disqualifying;
      if (is_reported && known.insert(finding.text).second) result->warnings.push_back(finding.text);
    }
  }
}

bool is_better(const RecordingResult& result, const RecordingResult& before) {
  if (!result.tracked || !before.tracked) return result.tracked && !before.tracked;
  if (is_confirmed(result) != is_confirmed(before)) {
    return is_confirmed(result) ? is_most_of(result, before) : !is_most_of(before, result);
  }
  return score(result) > kChoice.margin * score(before);
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
  return static_cast<double>(result.trajectory.size()) >=
         kChoice.min_share * static_cast<double>(before.trajectory.size());
}

std::set<std::int64_t> frames_of(const std::vector<RegisteredFrame>& trajectory) {
  std::set<std::int64_t> frames;
  for (const RegisteredFrame& frame : trajectory) frames.insert(frame.index);
  return frames;
}

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

void exclude_covered_maps(std::vector<FinishedMap>* maps) {
  if (maps->empty()) return;
  const std::set<std::int64_t> in_first = frames_of(maps->front().trajectory);
  const auto is_covered = [&](const FinishedMap& map) {
    const std::set<std::int64_t> frames = frames_of(map.trajectory);
    return !map.is_loaded() && std::includes(in_first.begin(), in_first.end(), frames.begin(), frames.end());
  };
  maps->erase(std::remove_if(maps->begin() + 1, maps->end(), is_covered), maps->end());
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

bool may_distort_path(std::size_t doubtful, std::size_t registered) {
  if (registered == 0) return false;
  const auto n = static_cast<double>(registered), d = static_cast<double>(doubtful);
  // Relative to the path, of one step for each image: root mean square over all images.
  return d > kFindings.most_doubtful * n ||
         kFindings.doubtful_steps / n * std::sqrt(d / n) > QualityOptions().max_path_sigma;
}

}  // namespace mono_pose_tracker
