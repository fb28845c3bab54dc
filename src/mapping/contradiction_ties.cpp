#include "contradiction_ties.h"

#include <cstddef>
#include <vector>

#include "keyframe_landmarks.h"
#include "likely_sight.h"
#include "mono_pose_tracker/mapping/contradiction.h"
#include "mono_pose_tracker/robust/relative_pose.h"
#include "view_linker.h"

namespace mono_pose_tracker {

namespace {

// Of landmarks that the first sees.
std::vector<Match> usable(const Keyframe& first, const Keyframe& second, const std::vector<Match>& matches,
                          const IsLeftOut& is_left_out) {
  std::vector<Match> of_landmarks;
  for (const Match& m : matches) {
    if (first.landmark_of_feature[m.first] == kNoLandmark || is_left_out(first.id, m.first) ||
        is_left_out(second.id, m.second)) {
      continue;
    }
    of_landmarks.push_back(m);
  }
  return of_landmarks;
}

// Those of the matches, and of the sights that they are, that a pose of the second explains by what the first
// has of the map; none where the second would contradict it in that pose as well.
std::vector<char> explained_by_pose(const MapperOptions& options, const Map& map, const Keyframe& first,
                                    const Keyframe& second, const std::vector<Match>& matches,
                                    const std::vector<LikelySight>& sights) {
  AbsolutePoseOptions pose_options;
  pose_options.ransac = options.ransac;
  pose_options.asks_outliers = true;
  const AbsolutePoseReport pose = pose_by(map, second, sights, pose_options);
  if (!is_same_place(options, pose)) return {};
  Keyframe posed = second;
  posed.camera_from_map = pose.camera_from_map;
  if (contradiction_between(map, first, posed, matches).is_significant()) return {};
  std::vector<char> explained;
  for (const LikelySight& s : sights) {
    explained.push_back(error_px(posed, s.feature, map.landmark(s.landmark)->x_in_map) <
                        options.mapping.max_reprojection_px);
  }
  return explained;
}

// Those that one motion between the two images explains, whatever the map has of them: none where more speaks
// against it than against a right map.
std::vector<char> explained_by_motion(const MapperOptions& options, const Keyframe& first,
                                      const Keyframe& second, const std::vector<Match>& matches) {
  std::vector<Eigen::Vector3d> bearings1, bearings2;
  for (const Match& m : matches) {
    bearings1.push_back(first.image->set.bearings[m.first]);
    bearings2.push_back(second.image->set.bearings[m.second]);
  }
  RelativePoseOptions motion_options;
  motion_options.ransac = options.ransac;
  const RelativePoseReport motion = estimate_relative_pose(bearings1, bearings2, motion_options);
  const double least = (1 - Contradiction::kMostOfARightMap) * static_cast<double>(matches.size());
  if (!motion.success || motion.hypotheses.front().num_inliers < least) return {};
  // What is far agrees with any.
  if (motion.hypotheses.front().num_inliers - motion.rotation_only_inliers < options.min_inliers) return {};
  return motion.hypotheses.front().inliers;
}

std::vector<ViewTie> ties_between(const MapperOptions& options, const Map& map, const Keyframe& first,
                                  const Keyframe& second, const std::vector<Match>& all_matches,
                                  const IsLeftOut& is_left_out) {
  const std::vector<Match> matches = usable(first, second, all_matches, is_left_out);
  std::vector<LikelySight> sights;
  for (const Match& m : matches)
    sights.push_back({m.second, first.landmark_of_feature[m.first], m.distance2});
  std::vector<char> agrees = explained_by_pose(options, map, first, second, matches, sights);
  if (agrees.empty()) agrees = explained_by_motion(options, first, second, matches);
  return ties_of(sights, agrees, first, second);
}

// Where no run of the tracker lies between, and the poses may change.
bool are_of_this_run(const Keyframe& first, const Keyframe& second) {
  return !is_of_earlier_run(first.frame_index) && !is_of_earlier_run(second.frame_index);
}

}  // namespace

std::set<KeyframeId> tie_across_contradictions(const MapperOptions& options, const MatchesInTime& matches,
                                               const IsLeftOut& is_left_out, Map* map) {
  const std::vector<const Keyframe*> in_time = keyframes_in_time(*map);
  std::set<KeyframeId> tied;
  for (std::size_t i = 0; i + 1 < in_time.size() && !is_set(options.ransac.cancelled); ++i) {
    const Keyframe &first = *in_time[i], &second = *in_time[i + 1];
    if (!are_of_this_run(first, second)) continue;
    const auto tie = [&](const Keyframe& from, const Keyframe& to, const std::vector<Match>& between) {
      if (!contradiction_between(*map, from, to, between).is_significant()) return;
      const std::vector<ViewTie> ties = ties_between(options, *map, from, to, between, is_left_out);
      if (ties.empty()) return;
      tie_views(ties, map);
      tied.insert({from.id, to.id});
    };
    tie(first, second, matches[i]);
    tie(second, first, turned_round(matches[i]));
  }
  return tied;
}

int count_contradictions(const Map& map, const MatchesInTime& matches) {
  const std::vector<const Keyframe*> in_time = keyframes_in_time(map);
  int count = 0;
  for (std::size_t i = 0; i + 1 < in_time.size(); ++i) {
    if (!are_of_this_run(*in_time[i], *in_time[i + 1])) continue;
    count += contradiction_both_ways(map, *in_time[i], *in_time[i + 1], matches[i]).is_significant();
  }
  return count;
}

}  // namespace mono_pose_tracker
