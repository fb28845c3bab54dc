#include "epipolar_matcher.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mono_pose_tracker/geometry/essential.h"

namespace mono_pose_tracker {

namespace {

// From the line to the middle of the strip beside it, in half widths: what lies three half widths off is no
// match, whatever the poses have wrong that a map may have wrong.
constexpr float kStripBeside = 4;

std::vector<int> features_without_landmark(const Keyframe& keyframe) {
  std::vector<int> free;
  for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
    if (keyframe.landmark_of_feature[f] == kNoLandmark) free.push_back(static_cast<int>(f));
  }
  return free;
}

// Who is nearest to whom among the features of a strip along the epipolar lines.
struct StripMatches {
  std::vector<NearestTwo> of_first, of_second;

  StripMatches(std::size_t first, std::size_t second) : of_first(first), of_second(second) {}

  void offer(std::size_t i, std::size_t j, int distance2) {
    of_first[i].offer(static_cast<int>(j), distance2);
    of_second[j].offer(static_cast<int>(i), distance2);
  }

  // Mutual and clearly the nearest; first and second count among those compared.
  std::vector<Match> mutual(const EpipolarMatchOptions& options) const {
    const double min_ratio2 = options.min_ratio * options.min_ratio;
    std::vector<Match> matches;
    for (std::size_t i = 0; i < of_first.size(); ++i) {
      const NearestTwo& b = of_first[i];
      if (b.index < 0 || b.best > options.max_distance2 || of_second[b.index].index != static_cast<int>(i))
        continue;
      if (b.second != std::numeric_limits<int>::max() && b.best * min_ratio2 > b.second) continue;
      matches.push_back({static_cast<int>(i), b.index, b.best, 0});
    }
    return matches;
  }
};

std::vector<int> sorted_distances2(const std::vector<Match>& matches) {
  std::vector<int> distances;
  for (const Match& m : matches) distances.push_back(m.distance2);
  std::sort(distances.begin(), distances.end());
  return distances;
}

// Each feature has its match on the line or the one beside it, whichever is more alike; on the line in doubt.
void keep_winners(std::size_t features, std::vector<Match>* on_line, std::vector<Match>* beside) {
  constexpr int kNone = std::numeric_limits<int>::max();
  std::vector<int> best_on_line(features, kNone), best_beside(features, kNone);
  for (const Match& m : *on_line) best_on_line[m.first] = m.distance2;
  for (const Match& m : *beside) best_beside[m.first] = m.distance2;
  const auto keep = [](std::vector<Match>* matches, auto wins) {
    matches->erase(std::stable_partition(matches->begin(), matches->end(), wins), matches->end());
  };
  keep(on_line, [&](const Match& m) { return m.distance2 <= best_beside[m.first]; });
  keep(beside, [&](const Match& m) { return m.distance2 < best_on_line[m.first]; });
}

// The largest distance up to which at most that share of the matches is there by chance, which wins beside
// the line as often as on it; -1 where there is none.
int largest_sure_distance2(const std::vector<Match>& on_line, const std::vector<Match>& beside,
                           double max_chance_share) {
  const std::vector<int> found = sorted_distances2(on_line), by_chance = sorted_distances2(beside);
  int sure = -1;
  std::size_t chance = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    while (chance < by_chance.size() && by_chance[chance] <= found[i]) ++chance;
    if (static_cast<double>(chance) <= max_chance_share * static_cast<double>(i + 1)) sure = found[i];
  }
  return sure;
}

}  // namespace

std::vector<Match> match_along_epipolar_lines(const Keyframe& first, const Keyframe& second,
                                              const EpipolarMatchOptions& options) {
  const Eigen::Matrix3d essential =
      essential_matrix(second.camera_from_map * first.camera_from_map.inverse());
  const std::vector<int> free1 = features_without_landmark(first), free2 = features_without_landmark(second);
  Eigen::Matrix3Xf bearings2(3, free2.size());
  for (std::size_t j = 0; j < free2.size(); ++j) {
    bearings2.col(j) = second.image->set.bearings[free2[j]].cast<float>();
  }
  StripMatches on_line(free1.size(), free2.size()), beside(free1.size(), free2.size());
  Eigen::RowVectorXf from_plane(free2.size());
  // Scales are in px of each image's own camera.
  const double same_px = first.image->camera.focal() / second.image->camera.focal();
  for (std::size_t i = 0; i < free1.size(); ++i) {
    if (is_set(options.cancelled)) return {};
    const Eigen::Vector3d normal = essential * first.image->set.bearings[free1[i]];
    const double length = normal.norm();
    if (length < 1e-9) continue;  // at the epipole every line passes
    from_plane.noalias() = (normal / length).cast<float>().transpose() * bearings2;
    const double scale1 = first.image->set.features[free1[i]].scale;
    for (std::size_t j = 0; j < free2.size(); ++j) {
      const bool is_on_line = std::abs(from_plane[j]) <= options.max_error_rad;
      if (!is_on_line &&
          std::abs(from_plane[j] - kStripBeside * options.max_error_rad) > options.max_error_rad)
        continue;
      const double scale2 = same_px * second.image->set.features[free2[j]].scale;
      if (scale1 > options.max_scale_ratio * scale2 || scale2 > options.max_scale_ratio * scale1) continue;
      const int d2 =
          descriptor_distance2(first.image->set.descriptor(free1[i]), second.image->set.descriptor(free2[j]));
      (is_on_line ? on_line : beside).offer(i, j, d2);
    }
  }
  std::vector<Match> matches = on_line.mutual(options), by_chance = beside.mutual(options);
  keep_winners(free1.size(), &matches, &by_chance);
  const int sure = largest_sure_distance2(matches, by_chance, options.max_chance_share);
  const auto unsure =
      std::remove_if(matches.begin(), matches.end(), [&](const Match& m) { return m.distance2 > sure; });
  matches.erase(unsure, matches.end());
  for (Match& m : matches) {
    m.first = free1[m.first];
    m.second = free2[m.second];
  }
  return matches;
}

}  // namespace mono_pose_tracker
