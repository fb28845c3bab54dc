#include "recording_findings.h"

#include <cmath>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "common/text.h"
#include "finished_maps.h"

namespace mono_pose_tracker {

namespace {

std::string name_of(std::size_t map) { return map == 0 ? "" : "map_" + std::to_string(map + 1) + ": "; }

void report_other_object(FinishedMap* map) {
  const IndependentMotion& other = map->independent_motion;
  const auto percent = std::lround(100 * other.share());
  Finding finding;
  finding.kind = FindingKind::kOtherObject;
  if (map->is_of_other_object) {
    finding.text = formatted(
        "Two rigid objects move, and it is not clear whether the map is of the turning one "
        "(segmentation/body): %ld %% of the matches move with the other. Mask the one that is wanted "
        "(--masks).",
        percent);
  } else if (map->is_of_smaller_object) {
    finding.text = formatted(
        "Two rigid objects move, and the map is of the smaller: %ld %% of the matches move "
        "with the other. Mask the one that is wanted (--masks).",
        percent);
  } else if (other.is_comparable()) {
    finding.text = formatted(
        "A second rigid motion explains %ld %% of the matches: another object, or the near part of the map "
        "is "
        "wrong. Mask the object that is wanted (--masks), or use segmentation/body: turning "
        "(config/object.yaml).",
        percent);
  } else {
    return;
  }
  map->quality.add(std::move(finding));
}

void report_background(FinishedMap* map) {
  if (!map->shows_background) return;
  Finding finding;
  finding.kind = FindingKind::kStaticBackground;
  finding.text =
      "An object moves in front of a static background, and the map may contain both. Mask the object "
      "(--masks).";
  map->quality.add(std::move(finding));
}

std::string some_of(const std::vector<std::int64_t>& frames, std::size_t most) {
  std::string numbers;
  for (std::size_t i = 0; i < frames.size() && i < most; ++i) {
    numbers += (i == 0 ? "" : ", ") + std::to_string(frames[i]);
  }
  return frames.size() > most ? numbers + ", ..." : numbers;
}

// Images located in a loaded map rest on the images of earlier runs.
void report_uncertain_images(const RecordingFindingsOptions& options, std::set<std::int64_t> doubtful,
                             std::size_t place, FinishedMap* map) {
  if (!map->is_loaded()) doubtful.merge(isolated_frames(map->trajectory, options.doubtful));
  const std::vector<std::int64_t> alone = doubtful_alone(map->trajectory, doubtful);
  if (alone.empty()) return;
  Finding finding;
  finding.kind = FindingKind::kUncertainImages;
  finding.images = alone;
  finding.k = static_cast<int>(alone.size());
  finding.n = static_cast<int>(map->trajectory.size());
  finding.is_disqualifying = may_distort_path(alone.size(), map->trajectory.size(), options.doubtful);
  finding.text = name_of(place) +
                 formatted(
                     "The poses of %d of %d images are uncertain (%s): few landmarks, far from the predicted "
                     "motion, or after a gap. Exclude these images where a wrong pose matters.",
                     finding.k, finding.n, some_of(alone, options.listed_images).c_str());
  map->quality.add(std::move(finding));
}

// A small map other than the first has too few images to be checked.
void report_small_map(std::size_t least, std::size_t place, FinishedMap* map) {
  if (place == 0 || map->is_loaded() || map->trajectory.size() >= least) return;
  Finding finding;
  finding.kind = FindingKind::kFewImages;
  finding.k = static_cast<int>(map->trajectory.size());
  finding.n = static_cast<int>(least);
  finding.text = name_of(place) +
                 formatted("The map has only %d images; a map other than the first needs %d to be confirmed.",
                           finding.k, finding.n);
  map->quality.add(std::move(finding));
}

void report_several_maps(RecordingResult* result) {
  if (result->maps.size() < 2) return;
  Finding finding;
  finding.kind = FindingKind::kSeveralMaps;
  finding.k = static_cast<int>(frames_outside_first(result->maps));
  finding.n = static_cast<int>(result->frames_total);
  finding.is_disqualifying = false;
  finding.text = formatted(
      "The recording is in %zu maps that share no matches; %d images are not in the first. "
      "Each map has its own frame and unit (map_2, ...). Record more overlap.",
      result->maps.size(), finding.k);
  result->maps.front().quality.add(std::move(finding));
}

// Missing images are easily overlooked in a trajectory.
void report_unregistered(double most_share, RecordingResult* result) {
  std::set<std::int64_t> registered;
  for (const FinishedMap& map : result->maps) registered.merge(frames_of(map.trajectory));
  std::int64_t run = 0, longest = 0, last = -1;
  Finding finding;
  finding.kind = FindingKind::kUnregisteredImages;
  finding.is_disqualifying = false;
  for (const auto& name : result->names) {
    const bool has_none = registered.count(name.first) == 0;
    if (has_none) finding.images.push_back(name.first);
    run = has_none ? run + 1 : 0;
    if (run > longest) longest = run, last = name.first;
  }
  finding.k = static_cast<int>(finding.images.size());
  finding.n = static_cast<int>(result->frames_total);
  if (finding.k <= most_share * finding.n) return;
  finding.text = formatted("%d of %d images have no pose, the longest gap is from %ld to %ld: ", finding.k,
                           finding.n, static_cast<long>(last - longest + 1), static_cast<long>(last));
  const auto unusable = static_cast<long>(result->frames_total - result->frames_with_features);
  if (unusable >= finding.k) {
    finding.text += "these images have no features, or not the size of the calibration.";
  } else if (unusable > 0) {
    finding.text += formatted(
        "%ld of these have no features, or not the size of the calibration; the rest are dark or blurred, or "
        "overlap too little.",
        unusable);
  } else {
    finding.text += "dark, blurred, or too little overlap with the others.";
  }
  result->maps.front().quality.add(std::move(finding));
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

}  // namespace

void add_findings(RecordingResult* result, const RecordingFindingsOptions& options) {
  std::vector<FinishedMap>& maps = result->maps;
  spread_few_images(result);
  for (std::size_t i = 0; i < maps.size(); ++i) {
    report_uncertain_images(options, result->doubtful, i, &maps[i]);
    report_small_map(options.least_outside_first, i, &maps[i]);
  }
  report_other_object(&maps.front());
  report_background(&maps.front());
  report_several_maps(result);
  report_unregistered(options.most_unregistered, result);
  std::set<std::string> known;
  for (std::size_t i = 0; i < maps.size(); ++i) {
    for (const Finding& finding : maps[i].quality.findings()) {
      const bool is_reported = i == 0 || finding.is_disqualifying;
      if (is_reported && known.insert(finding.text).second) result->warnings.push_back(finding.text);
    }
  }
}

void add_finding(Finding finding, RecordingResult* result) {
  result->warnings.push_back(finding.text);
  for (FinishedMap& map : result->maps) map.quality.add(finding);
}

}  // namespace mono_pose_tracker
