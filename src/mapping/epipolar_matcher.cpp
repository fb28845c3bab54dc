#include "epipolar_matcher.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/threads.h"
#include "geometry/essential.h"

namespace mono_pose_tracker {

namespace {

// Relative margin of the searched range, for rounding.
constexpr double kMargin = 1.001;

std::vector<int> features_without_landmark(const Keyframe& keyframe) {
  std::vector<int> free;
  for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
    if (keyframe.landmark_of_feature[f] == kNoLandmark) free.push_back(static_cast<int>(f));
  }
  return free;
}

// Fewer features are compared faster than a thread starts.
constexpr int kLeastOfThread = 128;

// Nearest neighbours between the features of a strip along the epipolar lines.
struct StripMatches {
  std::vector<NearestTwo> of_first, of_second;

  StripMatches(std::size_t first, std::size_t second) : of_first(first), of_second(second) {}

  void offer(std::size_t i, std::size_t j, int distance2) {
    of_first[i].offer(static_cast<int>(j), distance2);
    of_second[j].offer(static_cast<int>(i), distance2);
  }

  // Appends the results of later features of the first image.
  void take(const StripMatches& later) {
    for (std::size_t i = 0; i < of_first.size(); ++i) of_first[i].take(later.of_first[i]);
    for (std::size_t j = 0; j < of_second.size(); ++j) of_second[j].take(later.of_second[j]);
  }

  // Mutual nearest neighbours that pass the ratio test; indices are those of the compared features.
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

// Keeps for each feature its match on the line or in the decoy strip, whichever has the more similar
// descriptor; of equals, the one on the line.
void keep_winners(std::size_t features, std::vector<Match>* on_line, std::vector<Match>* decoy) {
  std::vector<int> best_on_line(features, std::numeric_limits<int>::max()), best_decoy = best_on_line;
  for (const Match& m : *on_line) best_on_line[m.first] = m.distance2;
  for (const Match& m : *decoy) best_decoy[m.first] = m.distance2;
  const auto keep = [](std::vector<Match>* matches, auto wins) {
    matches->erase(std::stable_partition(matches->begin(), matches->end(), wins), matches->end());
  };
  keep(on_line, [&](const Match& m) { return m.distance2 <= best_decoy[m.first]; });
  keep(decoy, [&](const Match& m) { return m.distance2 < best_on_line[m.first]; });
}

// The largest descriptor distance up to which at most the given share of matches is accidental; -1 where
// there is none. Accidental matches win in the decoy strip as often as on the line.
int largest_sure_distance2(const std::vector<Match>& on_line, const std::vector<Match>& decoy,
                           double max_chance_share) {
  const std::vector<int> found = sorted_distances2(on_line), by_chance = sorted_distances2(decoy);
  int sure = -1;
  std::size_t chance = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    while (chance < by_chance.size() && by_chance[chance] <= found[i]) ++chance;
    if (static_cast<double>(chance) <= max_chance_share * static_cast<double>(i + 1)) sure = found[i];
  }
  return sure;
}

// Matches on the epipolar lines and in the decoy strips.
struct BothStrips {
  StripMatches on_line, decoy;

  BothStrips(std::size_t first, std::size_t second) : on_line(first, second), decoy(first, second) {}
};

// Compares all features of two keyframes that have no landmark.
class Comparison {
 public:
  Comparison(const Keyframe& first, const Keyframe& second, const EpipolarMatchOptions& options)
      : first_(first),
        second_(second),
        options_(options),
        second_from_first_(second.camera_from_map * first.camera_from_map.inverse()),
        essential_(essential_matrix(second_from_first_)),
        free1_(features_without_landmark(first)),
        fan2_(*second.image, second_from_first_.translation, features_without_landmark(second),
              -kMargin * options.max_error_rad, kMargin * (options.decoy_strip + 1) * options.max_error_rad) {
    const double same_px = first.image->camera.focal() / second.image->camera.focal();
    for (const int f : free2()) scales2_.push_back(same_px * second.image->set.features[f].scale);
  }

  BothStrips all() const {
    const int size = static_cast<int>(free1_.size());
    const int parts = std::clamp(size / kLeastOfThread, 1, std::max(options_.threads, 1));
    std::vector<BothStrips> found(parts, BothStrips(free1_.size(), free2().size()));
    parallel_for(parts, parts, [&](int part) {
      const auto end_of = [&](int p) { return static_cast<std::size_t>(size) * p / parts; };
      compare(end_of(part), end_of(part + 1), &found[part]);
    });
    for (int part = 1; part < parts; ++part) {
      found[0].on_line.take(found[part].on_line);
      found[0].decoy.take(found[part].decoy);
    }
    return std::move(found[0]);
  }

  std::size_t of_first() const { return free1_.size(); }
  // The match with the keyframes' feature indices.
  Match named(const Match& m) const { return {free1_[m.first], free2()[m.second], m.distance2, m.ratio}; }

 private:
  const std::vector<int>& free2() const { return fan2_.features(); }

  void compare(std::size_t begin, std::size_t end, BothStrips* found) const {
    std::vector<EpipolarFan::NearPlane> near;
    for (std::size_t i = begin; i < end && !is_set(options_.cancelled); ++i) {
      const Eigen::Vector3d normal = essential_ * first_.image->set.bearings[free1_[i]];
      const double length = normal.norm();
      if (!(length >= 1e-9)) continue;  // every epipolar line passes the epipole
      fan2_.find_near(normal / length, &near);
      for (const auto& [j, from_plane] : near) offer(i, j, from_plane, found);
    }
  }

  void offer(std::size_t i, std::size_t j, float from_plane, BothStrips* found) const {
    const double limit = options_.max_error_rad;
    const bool is_on_line = std::abs(from_plane) <= limit;
    if (!is_on_line && std::abs(from_plane - options_.decoy_strip * limit) > limit) return;
    const double scale1 = first_.image->set.features[free1_[i]].scale, scale2 = scales2_[j];
    if (scale1 > options_.max_scale_ratio * scale2 || scale2 > options_.max_scale_ratio * scale1) return;
    const int d2 = descriptor_distance2(first_.image->set.descriptor(free1_[i]),
                                        second_.image->set.descriptor(free2()[j]));
    (is_on_line ? found->on_line : found->decoy).offer(i, j, d2);
  }

  const Keyframe &first_, &second_;
  const EpipolarMatchOptions& options_;
  const Rigid3 second_from_first_;
  const Eigen::Matrix3d essential_;
  const std::vector<int> free1_;  // compared features of the first
  const EpipolarFan fan2_;        // compared features of the second
  std::vector<double> scales2_;   // of fan2_'s features, in px of the first image's camera
};

}  // namespace

std::vector<Match> match_along_epipolar_lines(const Keyframe& first, const Keyframe& second,
                                              const EpipolarMatchOptions& options) {
  const Comparison comparison(first, second, options);
  const BothStrips found = comparison.all();
  if (is_set(options.cancelled)) return {};
  std::vector<Match> matches = found.on_line.mutual(options), by_chance = found.decoy.mutual(options);
  keep_winners(comparison.of_first(), &matches, &by_chance);
  const int sure = largest_sure_distance2(matches, by_chance, options.max_chance_share);
  const auto unsure =
      std::remove_if(matches.begin(), matches.end(), [&](const Match& m) { return m.distance2 > sure; });
  matches.erase(unsure, matches.end());
  for (Match& m : matches) m = comparison.named(m);
  return matches;
}

namespace {

// Bins of the full angle: each holds a few of the 3000 features of a large image.
constexpr int kBins = 1024;

// Bearings that are tested at once.
constexpr int kBlock = 16;

// Distance from the epipole, in units of the largest distance from a plane. A feature farther off is near
// only those planes whose angle differs by less than the inverse, about 6 degrees.
constexpr double kFar = 10;

constexpr int kClose = -1;

int whole_blocks(int count) { return (count + kBlock - 1) / kBlock * kBlock; }

}  // namespace

EpipolarFan::EpipolarFan(const ImageFeatures& image, const Eigen::Vector3d& epipole,
                         const std::vector<int>& features, double least, double most)
    : u_(epipole.unitOrthogonal()),
      v_(epipole.normalized().cross(u_)),
      middle_(static_cast<float>(0.5 * (least + most))),
      half_(static_cast<float>(0.5 * (most - least))),
      first_in_bin_(kBins + 1, 0) {
  const double far = kFar * std::max(most, -least);
  from_normal_ = std::acos(most / far);
  to_normal_ = std::acos(least / far);
  std::vector<int> bins;  // of the features; those close to the epipole come first
  bins.reserve(features.size());
  for (const int f : features) {
    const double x = image.set.bearings[f].dot(u_), y = image.set.bearings[f].dot(v_);
    bins.push_back(x * x + y * y < far * far ? kClose : bin_of(std::atan2(y, x)));
    ++(bins.back() == kClose ? close_ : first_in_bin_[bins.back() + 1]);
  }
  first_in_bin_[0] = close_;
  for (int bin = 0; bin < kBins; ++bin) first_in_bin_[bin + 1] += first_in_bin_[bin];
  put_in_order(image, features, bins);
}

// Sorts the features by bin; the order within a bin is the given one.
void EpipolarFan::put_in_order(const ImageFeatures& image, const std::vector<int>& features,
                               const std::vector<int>& bins) {
  bearings_ = Bearings::Zero(whole_blocks(static_cast<int>(features.size())), 3);
  features_.resize(features.size());
  std::vector<int> next = first_in_bin_;
  int next_close = 0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const int place = bins[i] == kClose ? next_close++ : next[bins[i]]++;
    features_[place] = features[i];
    bearings_.row(place) = image.set.bearings[features[i]].cast<float>().transpose().array();
  }
}

int EpipolarFan::bin_of(double angle) {
  const double turns = angle / (2 * M_PI) + 0.5;
  if (!std::isfinite(turns)) return 0;  // no baseline, no epipolar plane
  return std::clamp(static_cast<int>(kBins * (turns - std::floor(turns))), 0, kBins - 1);
}

void EpipolarFan::find_near(const Eigen::Vector3d& normal, std::vector<NearPlane>* near) const {
  near->clear();
  const Eigen::Vector3f across = normal.cast<float>();
  int done = whole_blocks(close_);
  find_in(0, done, across, near);
  for (const Range& range : ranges_near(std::atan2(normal.dot(v_), normal.dot(u_)))) {
    if (range.begin == range.end) continue;
    const int begin = std::max(done, range.begin / kBlock * kBlock);
    done = std::max(done, whole_blocks(range.end));
    find_in(begin, done, across, near);
  }
}

// Ranges in the sorted order for both half-planes, each of which may wrap around. Unused ranges are empty.
std::array<EpipolarFan::Range, 4> EpipolarFan::ranges_near(double normal_angle) const {
  std::array<Range, 4> ranges{};
  const auto bins = [&](int first, int last) { return Range{first_in_bin_[first], first_in_bin_[last + 1]}; };
  for (int half = 0; half < 2; ++half) {
    const double from = normal_angle + (half == 0 ? from_normal_ : -to_normal_);
    const double to = normal_angle + (half == 0 ? to_normal_ : -from_normal_);
    const int first = bin_of(from), last = bin_of(to);
    if (first <= last) {
      ranges[2 * half] = bins(first, last);
    } else {
      ranges[2 * half] = bins(first, kBins - 1);
      ranges[2 * half + 1] = bins(0, last);
    }
  }
  std::sort(ranges.begin(), ranges.end(), [](const Range& a, const Range& b) { return a.begin < b.begin; });
  return ranges;
}

void EpipolarFan::find_in(int begin, int end, const Eigen::Vector3f& normal,
                          std::vector<NearPlane>* near) const {
  const int size = static_cast<int>(features_.size());
  for (int i = begin; i < end; i += kBlock) {
    const Eigen::Array<float, kBlock, 1> distances = bearings_.col(0).segment<kBlock>(i) * normal.x() +
                                                     bearings_.col(1).segment<kBlock>(i) * normal.y() +
                                                     bearings_.col(2).segment<kBlock>(i) * normal.z();
    if ((distances - middle_).abs().minCoeff() > half_) continue;
    for (int k = 0; k < kBlock && i + k < size; ++k) {
      if (std::abs(distances[k] - middle_) <= half_) near->push_back({i + k, distances[k]});
    }
  }
}

}  // namespace mono_pose_tracker
