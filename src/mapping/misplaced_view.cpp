#include "mono_pose_tracker/mapping/misplaced_view.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <vector>

#include "keyframe_landmarks.h"
#include "mono_pose_tracker/common/angles.h"
#include "mono_pose_tracker/common/count_deviations.h"
#include "mono_pose_tracker/common/parallel.h"
#include "mono_pose_tracker/mapping/contradiction.h"
#include "mono_pose_tracker/mapping/place_index.h"
#include "worse_finding.h"

namespace mono_pose_tracker {

namespace {

// Of what one of two keyframes sees: those that share as much hold each other where they should be.
constexpr double kWellTied = 1.0 / 3;
// The place index's score, below which a quarter of the landmarks at most is found again: they look alike by
// little, and of what is found one match in three may be wrong.
constexpr double kLeastScore = 0.02;
// That look alike most, of many that see the same: the first may happen to agree with the map.
constexpr int kAsked = 3;
// SIFT does not find a thing again from sides so far apart, nor at such a distance: it is another one like
// it, as on a box whose sides are printed alike, or a window farther down the street.
const double kLeastViewCosine = std::cos(60 * kDegree);
constexpr double kMostTimesAsFar = 2.5;

using Keyframes = std::vector<const Keyframe*>;

class AlikeKeyframes {
 public:
  explicit AlikeKeyframes(const Map& map) : map_(map), in_time_(keyframes_in_time(map)) {
    for (const Keyframe* keyframe : in_time_)
      seen_by_[keyframe->id] = static_cast<int>(landmarks_of(*keyframe).size());
    for (const Keyframe* keyframe : in_time_) spread_part(*keyframe);
    if (parts_ < 2) return;  // as in most maps: none will be found
    for (const Keyframe* keyframe : in_time_) index_.add(keyframe->id, keyframe->image->set);
  }

  int size() const { return static_cast<int>(in_time_.size()); }
  const Keyframe& at(int i) const { return *in_time_[i]; }

  // Those of other parts, of the same run: between two runs a chair may have been moved.
  Keyframes most_alike(const Keyframe& keyframe) const {
    const auto is_asked = [&](KeyframeId id) {
      return part_of_.at(id) != part_of_.at(keyframe.id) &&
             is_of_earlier_run(map_.keyframe(id)->frame_index) == is_of_earlier_run(keyframe.frame_index);
    };
    Keyframes alike;
    for (const PlaceMatch& match : index_.query(keyframe.image->set, kAsked, is_asked)) {
      if (match.score >= kLeastScore) alike.push_back(map_.keyframe(match.id));
    }
    return alike;
  }

 private:
  // To all that a chain of well tied keyframes leads to from this one.
  void spread_part(const Keyframe& from) {
    if (!part_of_.emplace(from.id, parts_).second) return;
    std::vector<KeyframeId> open = {from.id};
    while (!open.empty()) {
      const KeyframeId id = open.back();
      open.pop_back();
      for (const auto& [other, shared] : map_.covisible(id)) {
        const bool is_well_tied = shared >= kWellTied * std::min(seen_by_.at(id), seen_by_.at(other));
        if (is_well_tied && part_of_.emplace(other, parts_).second) open.push_back(other);
      }
    }
    ++parts_;
  }

  const Map& map_;
  Keyframes in_time_;
  std::unordered_map<KeyframeId, int> seen_by_;  // how many landmarks
  std::unordered_map<KeyframeId, int> part_of_;
  int parts_ = 0;
  PlaceIndex index_;
};

bool can_be_found_again(const Map& map, const Keyframe& other, int feature, const Keyframe& own) {
  const Landmark* landmark = map.landmark(other.landmark_of_feature[feature]);
  if (!landmark) return false;
  const Eigen::Vector3d from_other = landmark->x_in_map - other.center_in_map(),
                        from_own = landmark->x_in_map - own.center_in_map();
  const double times_as_far = from_other.norm() / from_own.norm();
  return from_other.normalized().dot(from_own.normalized()) > kLeastViewCosine &&
         std::max(times_as_far, 1 / times_as_far) < kMostTimesAsFar;
}

MisplacedView compare(const Map& map, const Keyframe& other, const Keyframe& own,
                      const MatchOptions& matching) {
  std::vector<Match> matches =
      match_descriptors(other.image->set.descriptors, own.image->set.descriptors, matching);
  matches.erase(std::remove_if(matches.begin(), matches.end(),
                               [&](const Match& m) { return !can_be_found_again(map, other, m.first, own); }),
                matches.end());
  MisplacedView view;
  view.frame_index = own.frame_index;
  view.other_frame_index = other.frame_index;
  view.landmarks = static_cast<int>(landmarks_of(other).size());
  view.elsewhere = contradiction_between(map, other, own, matches).contradicting;
  return view;
}

// Of two: more stands elsewhere, and not by chance. Any is worse than none.
bool is_worse(const MisplacedView& a, const MisplacedView& b) {
  if ((a.landmarks == 0) != (b.landmarks == 0)) return b.landmarks == 0;
  return is_worse_finding(a, b, [](const MisplacedView& view) { return view.share(); });
}

}  // namespace

bool MisplacedView::is_significant() const {
  return share() >= kOfAWrongMap && deviations_above(kOfARightMap, elsewhere, landmarks) >= kDeviations;
}

MisplacedView most_misplaced_view(const Map& map, const MatchOptions& matching, int threads) {
  const AlikeKeyframes keyframes(map);
  std::vector<MisplacedView> views(keyframes.size());
  parallel_for(keyframes.size(), threads, [&](int i) {
    for (const Keyframe* other : keyframes.most_alike(keyframes.at(i))) {
      const MisplacedView view = compare(map, *other, keyframes.at(i), matching);
      if (is_worse(view, views[i])) views[i] = view;
    }
  });
  MisplacedView worst;
  for (const MisplacedView& view : views) {
    if (is_worse(view, worst)) worst = view;
  }
  return worst;
}

}  // namespace mono_pose_tracker
