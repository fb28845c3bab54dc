#include "mapping/independent_motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "common/median.h"
#include "common/parallel.h"
#include "ego_vehicle_features.h"
#include "feature_tracks.h"
#include "rotation_in_view.h"

namespace mono_pose_tracker {

namespace {

// Neighbours have most matches; distant keyframes separate slow motions.
constexpr std::array<int, 3> kApart = {1, 2, 4};

// With fewer matches the rotation is as large as its noise.
constexpr int kFewestToRotate = 25;

void count_obeying(const PairMotions& pair, IndependentMotion* result) {
  result->matches += static_cast<long>(pair.matches.size());
  result->obeying += std::count_if(pair.obeyed.begin(), pair.obeyed.end(), [](ObeyedMotion motion) {
    return motion == ObeyedMotion::kObject || motion == ObeyedMotion::kBoth;
  });
}

void compare(const RegisteredImage& first, const RegisteredImage& second, const PairMotions& pair,
             IndependentMotion* result) {
  ++result->pairs;
  if (!pair.has_other) return;
  ++result->other_pairs;
  const double map_rotation = rotation_between(first, second, pair, ObeyedMotion::kObject);
  const double other_rotation = rotation_between(first, second, pair, ObeyedMotion::kOther);
  result->map_rotation += map_rotation;
  result->other_rotation += other_rotation;
  const auto others = std::count(pair.obeyed.begin(), pair.obeyed.end(), ObeyedMotion::kOther);
  if (others >= kFewestToRotate && other_rotation > IndependentMotion::kPlainly * map_rotation)
    result->other_rotation_alone += other_rotation;
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
  images.reserve(by_index.size());
  for (const auto& entry : by_index) images.push_back(entry.second);
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (of_keyframes.count(images[i].frame_index)) keyframes->push_back(static_cast<int>(i));
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
  std::vector<int> spread;
  std::size_t next = 0;  // index of the next keyframe
  for (int i = 0; i < static_cast<int>(images.size()); ++i) {
    const bool is_keyframe = next < keyframes.size() && keyframes[next] == i;
    if (is_keyframe) ++next;
    const bool is_far = !spread.empty() && images[i].frame_index - images[spread.back()].frame_index >= usual;
    if (is_keyframe || is_far) spread.push_back(i);
  }
  return spread;
}

// Two images by their position in the order of time.
using Pair = std::pair<int, int>;

std::vector<PairMotions> compare_all(const std::vector<RegisteredImage>& images,
                                     const std::vector<Pair>& pairs, const MatchOptions& matching,
                                     const RansacOptions& ransac, int threads) {
  std::vector<PairMotions> motions(pairs.size());
  parallel_for(static_cast<int>(pairs.size()), threads, [&](int i) {
    motions[i] = compare_motions(images[pairs[i].first], images[pairs[i].second], matching, ransac);
  });
  return motions;
}

// Treats far matches behind the cameras as noise, unless there are too many. Noise puts half of the far
// points there. A map constrained by a skyline that is wrong about near points has more of them, and pose
// errors, common to all matches of a pair, add a few.
void excuse_noise(const std::vector<RegisteredImage>& images, const std::vector<Pair>& pairs,
                  const RansacOptions& ransac, std::vector<PairMotions>* motions) {
  constexpr double kMostBehind = 0.6;
  int far = 0;
  std::ptrdiff_t behind = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const FarMatches far_pair =
        far_matches((*motions)[i].matches, images[pairs[i].first], images[pairs[i].second], ransac);
    far += far_pair.count;
    behind += std::count(far_pair.behind.begin(), far_pair.behind.end(), 1);
  }
  if (static_cast<double>(behind) > kMostBehind * far) return;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    PairMotions& pair = (*motions)[i];
    pair = motions_of(std::move(pair.matches), images[pairs[i].first], images[pairs[i].second], ransac,
                      FarBehind::kIsNoise);
  }
}

// Votes of image pairs for the motion of each feature, summed over its track.
class Votes {
 public:
  // against: weight of a vote for the other motion; a vote for the map's has weight 1.
  Votes(const std::vector<RegisteredImage>& images, int against)
      : tracks_(feature_counts(images)), against_(against) {
    for (const RegisteredImage& image : images) of_feature_.emplace_back(image.image->size(), 0);
  }

  void add(const Pair& images, const PairMotions& pair) {
    const auto [first, second] = images;
    for (std::size_t i = 0; i < pair.matches.size(); ++i) {
      const Match& m = pair.matches[i];
      tracks_.join(first, m.first, second, m.second);
      if (!pair.has_other || pair.obeyed[i] == ObeyedMotion::kBoth) continue;
      const int value = pair.obeyed[i] == ObeyedMotion::kObject  ? 1
                        : pair.obeyed[i] == ObeyedMotion::kOther ? -against_
                                                                 : -1;
      of_feature_[first][m.first] += value;
      of_feature_[second][m.second] += value;
    }
  }

  void sum_over_tracks() {
    for (const FeatureTrack& track : tracks_.all()) {
      int sum = 0;
      for (const auto& [image, feature] : track) sum += of_feature_[image][feature];
      for (const auto& [image, feature] : track) of_feature_[image][feature] = sum;
    }
  }

  // Positive: a feature of the mapped object; negative: of the other one.
  int of(int image, int feature) const { return of_feature_[image][feature]; }

 private:
  FeatureTracks tracks_;
  int against_;
  std::vector<std::vector<int>> of_feature_;
};

void add_tracks(const std::vector<RegisteredImage>& images, int k, const PairMotions& pair,
                const Votes& votes, IndependentMotion* result) {
  // Cells hold some features each and separate a screen from the room around it.
  constexpr int kSquares = 8;  // along the longer side
  const RegisteredImage &first = images[k], &second = images[k + 1];
  const CameraModel& camera = first.image->camera;
  result->cell_px = static_cast<double>(std::max(camera.width(), camera.height())) / kSquares;
  for (const Match& m : pair.matches) {
    const int sum = votes.of(k, m.first) + votes.of(k + 1, m.second);
    if (sum == 0) continue;
    result->tracks.push_back({first.frame_index, second.frame_index, first.image->set.features[m.first].pixel,
                              second.image->set.features[m.second].pixel, sum < 0});
  }
}

}  // namespace

double IndependentMotion::share() const {
  const auto others = std::count_if(tracks.begin(), tracks.end(), [](const auto& t) { return t.is_other; });
  return tracks.empty() ? 0 : static_cast<double>(others) / static_cast<double>(tracks.size());
}

double IndependentMotion::share_of_view() const {
  std::map<std::tuple<std::int64_t, int, int>, int> votes;  // of each image's cells
  for (const MotionTrack& t : tracks) {
    votes[{t.from_index, static_cast<int>(t.from.x() / cell_px), static_cast<int>(t.from.y() / cell_px)}] +=
        t.is_other ? -1 : 1;
  }
  const auto decided = std::count_if(votes.begin(), votes.end(), [](const auto& v) { return v.second != 0; });
  const auto others = std::count_if(votes.begin(), votes.end(), [](const auto& v) { return v.second < 0; });
  return decided > 0 ? static_cast<double>(others) / static_cast<double>(decided) : 0;
}

IndependentMotion find_independent_motion(const Map& map, const std::vector<RegisteredImage>& seen,
                                          ComparedImages asked, const MatchOptions& matching,
                                          const RansacOptions& ransac, int threads) {
  std::vector<int> keyframes;
  const std::vector<RegisteredImage> images = in_time(map, seen, asked, &keyframes);
  IndependentMotion result;
  // Consecutive images may show little relative motion. A feature of the other object then obeys the map's
  // poses in every second pair or so; a feature of the mapped object obeys only the other motion, by a wrong
  // match, in one pair of fifty. The logarithms of these odds have a ratio of 1 to 4; half of that is used,
  // as the pairs of a track are not independent.
  const int against = asked == ComparedImages::kAllSeen ? 2 : 1;
  Votes votes(images, against);
  std::vector<Pair> in_a_row;
  for (int k = 0; k + 1 < static_cast<int>(images.size()); ++k) in_a_row.emplace_back(k, k + 1);
  const std::vector<PairMotions> neighbours = compare_all(images, in_a_row, matching, ransac, threads);
  for (std::size_t k = 0; k < neighbours.size(); ++k) votes.add(in_a_row[k], neighbours[k]);
  const std::vector<int> spread = spread_in_time(images, keyframes);
  for (const int apart : kApart) {
    std::vector<Pair> all, unknown;
    for (std::size_t k = 0; k + apart < spread.size(); ++k) {
      all.emplace_back(spread[k], spread[k + apart]);
      if (all.back().second != all.back().first + 1) unknown.push_back(all.back());
    }
    const std::vector<PairMotions> compared = compare_all(images, unknown, matching, ransac, threads);
    auto next = compared.begin();
    for (const auto& [first, second] : all) {
      const bool is_known = second == first + 1;
      const PairMotions& pair = is_known ? neighbours[first] : *next++;
      count_obeying(pair, &result);
      compare(images[first], images[second], pair, &result);
      if (!is_known) votes.add({first, second}, pair);
    }
  }
  if (result.other_pairs == 0) return result;
  votes.sum_over_tracks();
  for (std::size_t k = 0; k < neighbours.size(); ++k) {
    add_tracks(images, static_cast<int>(k), neighbours[k], votes, &result);
  }
  return result;
}

IndependentMotion sample_independent_motion(const Map& map, const MatchOptions& matching,
                                            const RansacOptions& ransac, bool camera_goes_through,
                                            bool is_connected, int threads) {
  constexpr int kPairs = 30;
  std::vector<int> keyframes;
  const std::vector<RegisteredImage> images = in_time(map, {}, ComparedImages::kKeyframes, &keyframes);
  const int count = static_cast<int>(images.size()) - 1;
  IndependentMotion result;
  Votes votes(images, 1);
  std::vector<Pair> pairs;
  for (int i = 0; i < std::min(kPairs, count); ++i) {
    const int k = i * count / std::min(kPairs, count);
    pairs.emplace_back(k, k + 1);
  }
  std::vector<PairMotions> motions = compare_all(images, pairs, matching, ransac, threads);
  if (camera_goes_through) exclude_ego_vehicle_features(images, pairs, ransac, &motions);
  // The same measure for all maps, as they are compared by it.
  for (const PairMotions& pair : motions) count_obeying(pair, &result);
  if (is_connected) excuse_noise(images, pairs, ransac, &motions);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    compare(images[pairs[i].first], images[pairs[i].second], motions[i], &result);
    votes.add(pairs[i], motions[i]);
  }
  votes.sum_over_tracks();
  for (std::size_t i = 0; i < pairs.size(); ++i)
    add_tracks(images, pairs[i].first, motions[i], votes, &result);
  return result;
}

double rotation_between(const RegisteredImage& first, const RegisteredImage& second, const PairMotions& pair,
                        ObeyedMotion motion) {
  std::vector<Eigen::Vector3d> bearings1, bearings2;
  for (std::size_t i = 0; i < pair.matches.size(); ++i) {
    if (pair.obeyed[i] != motion) continue;
    bearings1.push_back(first.image->set.bearings[pair.matches[i].first]);
    bearings2.push_back(second.image->set.bearings[pair.matches[i].second]);
  }
  return bearings1.size() < 5 ? 0 : rotation_in_view(bearings1, bearings2);
}

double rotation_before_cameras(const Map& map) {
  std::array<std::vector<double>, 3> places;
  for (const auto& entry : map.landmarks()) {
    for (int i = 0; i < 3; ++i) places[i].push_back(entry.second.x_in_map[i]);
  }
  if (places[0].empty()) return 0;
  const Eigen::Vector3d middle(median(std::move(places[0])), median(std::move(places[1])),
                               median(std::move(places[2])));
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

}  // namespace mono_pose_tracker
