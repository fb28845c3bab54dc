#include "mapping/motion_segmentation.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "common/statistics.h"
#include "common/threads.h"
#include "geometry/essential.h"
#include "geometry/nearest_rotation.h"
#include "keyframe_landmarks.h"
#include "mapping/feature_tracks.h"
#include "mapping/view_graph.h"
#include "mono_pose_tracker/robust/relative_pose.h"

namespace mono_pose_tracker {

namespace {

// Points behind a camera contradict as well, by however little: in a map that is constrained by a skyline, or
// followed a hand, the far points that intersect behind the cameras are the evidence.
std::vector<char> agree_with(const std::vector<Match>& matches, const FeatureSet& first,
                             const FeatureSet& second, const Rigid3& second_from_first, double limit) {
  const Eigen::Matrix3d essential = essential_matrix(second_from_first);
  std::vector<char> agree;
  for (const Match& m : matches) {
    const Eigen::Vector3d &x1 = first.bearings[m.first], &x2 = second.bearings[m.second];
    agree.push_back(std::abs(sampson_error(essential, x1, x2)) < limit &&
                    is_in_front(second_from_first, x1, x2));
  }
  return agree;
}

// Bearings of some matches in both images.
struct MatchedBearings {
  std::vector<Eigen::Vector3d> first, second;

  MatchedBearings() = default;
  template <typename IsChosen>
  MatchedBearings(const std::vector<Match>& matches, const FeatureSet& set1, const FeatureSet& set2,
                  const IsChosen& is_chosen) {
    for (std::size_t i = 0; i < matches.size(); ++i) {
      if (!is_chosen(i)) continue;
      first.push_back(set1.bearings[matches[i].first]);
      second.push_back(set2.bearings[matches[i].second]);
    }
  }
};

// The motion of the matches that contradict the mapped object; none when they do not agree on one, or on one
// that could not be matched.
RelativePoseReport fit_the_rest(const std::vector<Match>& matches, const std::vector<char>& of_object,
                                const FeatureSet& set1, const FeatureSet& set2,
                                const MotionSegmentationOptions& options) {
  const MatchedBearings rest(matches, set1, set2, [&](std::size_t i) { return !of_object[i]; });
  if (static_cast<int>(rest.first.size()) < options.min_members) return {};
  RelativePoseOptions pose;
  pose.ransac = options.ransac;
  pose.without_accidental_matches = false;  // another object's matches are localised
  RelativePoseReport report = estimate_relative_pose(rest.first, rest.second, pose);
  if (!report.success) return report;
  const RelativePoseHypothesis& best = report.hypotheses[0];
  MatchedBearings members;
  for (std::size_t i = 0; i < best.inliers.size(); ++i) {
    if (!best.inliers[i]) continue;
    members.first.push_back(rest.first[i]);
    members.second.push_back(rest.second[i]);
  }
  report.success = best.num_inliers >= options.min_members &&
                   best.num_inliers >= options.min_share * static_cast<double>(rest.first.size()) &&
                   rotation_in_view(members.first, members.second) < options.max_rotation;
  return report;
}

// Whether most of the nearest features of known motion have the second motion.
bool is_among_others(const PairMotions& pair, const std::vector<Feature>& features,
                     const Eigen::Vector2f& pixel, std::size_t voters) {
  DistantVotes known;
  for (std::size_t i = 0; i < pair.matches.size(); ++i) {
    if (pair.obeyed[i] != ObeyedMotion::kObject && pair.obeyed[i] != ObeyedMotion::kOther) continue;
    known.emplace_back((features[pair.matches[i].second].pixel - pixel).squaredNorm(),
                       pair.obeyed[i] == ObeyedMotion::kOther);
  }
  return most_of_nearest(voters, std::move(known));
}

// None for fewer matches than determine it.
std::optional<double> rotation_between(const RegisteredImage& first, const RegisteredImage& second,
                                       const PairMotions& pair, ObeyedMotion motion,
                                       const MotionSegmentationOptions& options) {
  const MatchedBearings of_motion(pair.matches, first.image->set, second.image->set,
                                  [&](std::size_t i) { return pair.obeyed[i] == motion; });
  if (of_motion.first.size() < options.min_rotating) return std::nullopt;
  return rotation_in_view(of_motion.first, of_motion.second);
}

// All images in the order of time, each once. `seen` has priority over a keyframe's own image, as features
// that are not plainly of the map were excluded from the latter.
std::vector<RegisteredImage> in_time(const Map& map, const std::vector<RegisteredImage>& seen,
                                     ComparedImages asked, std::vector<int>* keyframes) {
  std::set<std::int64_t> of_keyframes;
  for (const auto& entry : map.keyframes()) of_keyframes.insert(entry.second.frame_index);
  std::map<std::int64_t, RegisteredImage> by_index;
  for (const RegisteredImage& image : seen) {
    if (asked == ComparedImages::kAllSeen || of_keyframes.count(image.frame_index))
      by_index[image.frame_index] = image;
  }
  for (const auto& [id, k] : map.keyframes()) by_index.emplace(k.frame_index, registered_image(k));
  std::vector<RegisteredImage> images;
  for (const auto& [index, image] : by_index) {
    if (of_keyframes.count(index)) keyframes->push_back(static_cast<int>(images.size()));
    images.push_back(image);
  }
  return images;
}

// The keyframes, and images between them at the usual distance where no keyframe was made for long: a camera
// that hardly moves needs none while the other object may rotate.
std::vector<int> spread_in_time(const std::vector<RegisteredImage>& images,
                                const std::vector<int>& keyframes) {
  std::vector<double> gaps;
  for (std::size_t k = 0; k + 1 < keyframes.size(); ++k) {
    gaps.push_back(
        static_cast<double>(images[keyframes[k + 1]].frame_index - images[keyframes[k]].frame_index));
  }
  const auto usual = static_cast<std::int64_t>(median(std::move(gaps)));
  const std::set<int> of_keyframes(keyframes.begin(), keyframes.end());
  std::vector<int> spread;
  for (int i = 0; i < static_cast<int>(images.size()); ++i) {
    const bool is_far = !spread.empty() && images[i].frame_index - images[spread.back()].frame_index >= usual;
    if (is_far || of_keyframes.count(i)) spread.push_back(i);
  }
  return spread;
}

// Two images by their position in the order of time.
using Pair = std::pair<int, int>;

// Each image with the next, and keyframes at growing distances: neighbours have most matches, distant
// keyframes separate slow motions.
std::vector<Pair> pairs_of(int images, const std::vector<int>& keyframes) {
  std::vector<Pair> pairs;
  for (int k = 0; k + 1 < images; ++k) pairs.emplace_back(k, k + 1);
  for (const std::size_t apart : {1, 2, 4}) {
    for (std::size_t k = 0; k + apart < keyframes.size(); ++k) {
      if (keyframes[k + apart] > keyframes[k] + 1) pairs.emplace_back(keyframes[k], keyframes[k + apart]);
    }
  }
  return pairs;
}

std::vector<PairMotions> compare_all(const std::vector<RegisteredImage>& images,
                                     const std::vector<Pair>& pairs, const MotionSegmentationOptions& options,
                                     const ViewGraph* graph) {
  std::vector<PairMotions> motions(pairs.size());
  parallel_for(static_cast<int>(pairs.size()), options.threads, [&](int i) {
    motions[i] = compare_motions(images[pairs[i].first], images[pairs[i].second], options, graph);
  });
  return motions;
}

// against: weight of a vote for the other motion; a vote for the map's has weight 1.
void vote(const Pair& images, const PairMotions& pair, int against, TrackVotes* votes) {
  for (std::size_t i = 0; i < pair.matches.size(); ++i) {
    const Match& m = pair.matches[i];
    votes->join(images.first, m.first, images.second, m.second);
    if (!pair.has_other || pair.obeyed[i] == ObeyedMotion::kBoth) continue;
    TrackVotes::Count count{0, 1};
    if (pair.obeyed[i] == ObeyedMotion::kObject) count = {1, 0};
    if (pair.obeyed[i] == ObeyedMotion::kOther) count = {0, against};
    votes->add(images.first, m.first, count);
    votes->add(images.second, m.second, count);
  }
}

}  // namespace

MotionSegmentationOptions motion_segmentation_options(const MatchOptions& matching,
                                                      const RansacOptions& ransac, int threads) {
  MotionSegmentationOptions options;
  options.matching = matching;
  options.ransac = ransac;
  options.threads = threads;
  return options;
}

PairMotions compare_motions(const RegisteredImage& first, const RegisteredImage& second,
                            const MotionSegmentationOptions& options, const ViewGraph* graph) {
  const FeatureSet &set1 = first.image->set, &set2 = second.image->set;
  PairMotions pair;
  pair.matches = raw_matches(graph, {first.frame_index, first.image}, {second.frame_index, second.image},
                             options.matching);
  const double limit = options.contradicts * options.ransac.threshold;
  const std::vector<char> of_object =
      agree_with(pair.matches, set1, set2, second.camera_from_map * first.camera_from_map.inverse(), limit);
  const RelativePoseReport rest = fit_the_rest(pair.matches, of_object, set1, set2, options);
  pair.has_other = rest.success;
  std::vector<char> of_other(of_object.size(), 0);
  if (rest.success)
    of_other = agree_with(pair.matches, set1, set2, rest.hypotheses[0].second_from_first, limit);
  for (std::size_t i = 0; i < pair.matches.size(); ++i) {
    pair.obeyed.push_back(of_object[i] ? (of_other[i] ? ObeyedMotion::kBoth : ObeyedMotion::kObject)
                                       : (of_other[i] ? ObeyedMotion::kOther : ObeyedMotion::kNeither));
  }
  return pair;
}

SecondMotion second_motion_in(const PairMotions& pair, const ImageFeatures& first,
                              const ImageFeatures& second, const MotionSegmentationOptions& options) {
  if (!pair.has_other) return {};
  const std::vector<Feature>& features2 = second.set.features;
  SecondMotion found;
  found.of_first.assign(first.set.features.size(), 0);
  found.of_second.assign(features2.size(), 0);
  for (std::size_t i = 0; i < pair.matches.size(); ++i) {
    const Match& m = pair.matches[i];
    const bool is_other = pair.obeyed[i] == ObeyedMotion::kOther ||
                          (pair.obeyed[i] == ObeyedMotion::kBoth &&
                           is_among_others(pair, features2, features2[m.second].pixel, options.voters));
    found.of_first[m.first] = found.of_second[m.second] = is_other;
  }
  return found;
}

MotionEvidence& MotionEvidence::operator+=(const MotionEvidence& more) {
  pairs += more.pairs, other_pairs += more.other_pairs;
  of_map += more.of_map, of_other += more.of_other;
  map_rotation += more.map_rotation, other_rotation += more.other_rotation;
  return *this;
}

double MotionEvidence::share() const {
  return of_other > 0 ? static_cast<double>(of_other) / static_cast<double>(of_map + of_other) : 0;
}

MotionEvidence evidence_of(const RegisteredImage& first, const RegisteredImage& second,
                           const PairMotions& pair, const MotionSegmentationOptions& options) {
  MotionEvidence evidence;
  evidence.pairs = 1;
  evidence.of_map = std::count(pair.obeyed.begin(), pair.obeyed.end(), ObeyedMotion::kObject);
  if (!pair.has_other) return evidence;
  evidence.other_pairs = 1;
  evidence.of_other = std::count(pair.obeyed.begin(), pair.obeyed.end(), ObeyedMotion::kOther);
  const auto of_map = rotation_between(first, second, pair, ObeyedMotion::kObject, options),
             of_other = rotation_between(first, second, pair, ObeyedMotion::kOther, options);
  if (of_map && of_other) evidence.map_rotation = *of_map, evidence.other_rotation = *of_other;
  return evidence;
}

IndependentMotion find_independent_motion(const Map& map, const std::vector<RegisteredImage>& seen,
                                          ComparedImages asked, const MotionSegmentationOptions& options,
                                          const ViewGraph* graph) {
  std::vector<int> keyframes;
  const std::vector<RegisteredImage> images = in_time(map, seen, asked, &keyframes);
  const std::vector<int> spread = spread_in_time(images, keyframes);
  const std::vector<Pair> pairs = pairs_of(static_cast<int>(images.size()), spread);
  const std::vector<PairMotions> motions = compare_all(images, pairs, options, graph);
  // Consecutive images may show little relative motion. A feature of the other object then obeys the map's
  // poses in every second pair or so; a feature of the mapped object obeys only the other motion, by a wrong
  // match, in one pair of fifty. The logarithms of these odds have a ratio of 1 to 4; half of that is used,
  // as the pairs of a track are not independent.
  const int against = asked == ComparedImages::kAllSeen ? 2 : 1;
  const std::set<int> is_spread(spread.begin(), spread.end());
  IndependentMotion result;
  TrackVotes votes(images);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto& [first, second] = pairs[i];
    vote(pairs[i], motions[i], against, &votes);
    if (is_spread.count(first) && is_spread.count(second))
      result += evidence_of(images[first], images[second], motions[i], options);
  }
  if (result.other_pairs == 0) return result;
  votes.sum_over_tracks();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto& [first, second] = pairs[i];
    if (second != first + 1) continue;
    for (const Match& m : motions[i].matches) {
      const TrackVotes::Count count = votes.of(first, m.first) + votes.of(second, m.second);
      if (count.pro == count.contra) continue;
      result.tracks.push_back({images[first].frame_index, images[second].frame_index,
                               images[first].image->set.features[m.first].pixel,
                               images[second].image->set.features[m.second].pixel, count.pro < count.contra});
    }
  }
  return result;
}

MotionEvidence sample_independent_motion(const Map& map, const std::vector<int>& distances,
                                         const MotionSegmentationOptions& options, const ViewGraph* graph) {
  std::vector<int> keyframes;
  const std::vector<RegisteredImage> images = in_time(map, {}, ComparedImages::kKeyframes, &keyframes);
  const int count = static_cast<int>(images.size());
  std::vector<Pair> pairs;
  for (const int apart : distances) {
    const int all = count - apart, sampled = std::min(options.sampled_pairs, all);
    for (int i = 0; i < sampled; ++i) {
      const int k = i * all / sampled;
      pairs.emplace_back(k, k + apart);
    }
  }
  const std::vector<PairMotions> motions = compare_all(images, pairs, options, graph);
  MotionEvidence evidence;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    evidence += evidence_of(images[pairs[i].first], images[pairs[i].second], motions[i], options);
  return evidence;
}

double rotation_before_cameras(const Map& map) {
  if (map.landmarks().empty()) return 0;
  const Eigen::Vector3d middle = median_position(map);
  std::vector<Eigen::Vector3d> to_cameras;
  for (const auto& entry : map.keyframes()) {
    to_cameras.push_back((entry.second.center_in_map() - middle).normalized());
  }
  double widest = 0;
  for (const Eigen::Vector3d& a : to_cameras) {
    for (const Eigen::Vector3d& b : to_cameras)
      widest = std::max(widest, std::acos(std::clamp(a.dot(b), -1.0, 1.0)));
  }
  return widest;
}

namespace {

std::vector<double> left_over(const std::vector<Eigen::Vector3d>& bearings1,
                              const std::vector<Eigen::Vector3d>& bearings2,
                              const Eigen::Matrix3d& rotation) {
  std::vector<double> lengths;
  for (std::size_t i = 0; i < bearings1.size(); ++i) {
    lengths.push_back((rotation * bearings1[i] - bearings2[i]).norm());
  }
  return lengths;
}

// Residual motion after the rotation that explains most of it.
std::vector<double> left_over_by_rotation(const std::vector<Eigen::Vector3d>& bearings1,
                                          const std::vector<Eigen::Vector3d>& bearings2) {
  constexpr RotationInViewOptions options{};
  std::vector<double> lengths(bearings1.size(), 0);
  for (int round = 0; round < options.rounds; ++round) {
    const double farthest = options.far * median(lengths);
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < bearings1.size(); ++i) {
      if (lengths[i] <= farthest) sum += bearings2[i] * bearings1[i].transpose();
    }
    lengths = left_over(bearings1, bearings2, nearest_rotation(sum));
  }
  return lengths;
}

}  // namespace

double rotation_in_view(const std::vector<Eigen::Vector3d>& bearings1,
                        const std::vector<Eigen::Vector3d>& bearings2) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& b : bearings1) middle += b;
  middle.normalize();
  std::vector<double> away;
  for (const Eigen::Vector3d& b : bearings1) away.push_back((b - middle).norm());
  return median(left_over_by_rotation(bearings1, bearings2)) / std::max(median(std::move(away)), 1e-6);
}

}  // namespace mono_pose_tracker
