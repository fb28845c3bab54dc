#include "mono_pose_tracker/mapping/misplaced_view.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <unordered_map>
#include <vector>

#include "keyframe_landmarks.h"
#include "mono_pose_tracker/common/angles.h"
#include "mono_pose_tracker/common/count_deviations.h"
#include "mono_pose_tracker/common/parallel.h"
#include "mono_pose_tracker/mapping/contradiction.h"
#include "mono_pose_tracker/mapping/place_index.h"

namespace mono_pose_tracker {

namespace {

// Of what a keyframe sees: two that share as much are where they should be, beside each other.
constexpr double kWellTied = 1.0 / 3;
// The place index's score, below which a quarter of the landmarks at most is found again: they look alike by
// little, and of what is found one match in three may be wrong.
constexpr double kLeastScore = 0.02;
// That look alike most: the first may be of the same part of the recording.
constexpr int kAsked = 3;
// SIFT does not find a thing again from sides so far apart, nor at such a distance: it is another one like
// it, as on a box whose sides are printed alike, or a window farther down the street.
const double kLeastViewCosine = std::cos(60 * kDegree);
constexpr double kMostTimesAsFar = 2.5;

using Keyframes = std::vector<const Keyframe*>;

class AlikeKeyframes {
 public:
  explicit AlikeKeyframes(const Map& map) : map_(map), in_time_(keyframes_in_time(map)) {
    for (std::size_t i = 0; i < in_time_.size(); ++i) {
      index_.add(in_time_[i]->id, in_time_[i]->image->set);
      position_of_[in_time_[i]->id] = static_cast<int>(i);
    }
  }

  int size() const { return static_cast<int>(in_time_.size()); }
  const Keyframe& at(int i) const { return *in_time_[i]; }

  Keyframes most_alike(int i) const {
    const std::unordered_map<KeyframeId, int> shared = shared_landmarks(at(i));
    const double well_tied = kWellTied * shared.at(at(i).id);
    const auto is_asked = [&](KeyframeId id) {
      const int other = position_of_.at(id);
      const auto tied = shared.find(id);
      return std::abs(other - i) > 1 && is_of_earlier_run(other) == is_of_earlier_run(i) &&
             (tied == shared.end() || tied->second < well_tied);
    };
    Keyframes alike;
    for (const PlaceMatch& match : index_.query(at(i).image->set, kAsked, is_asked)) {
      if (match.score >= kLeastScore) alike.push_back(map_.keyframe(match.id));
    }
    return alike;
  }

 private:
  // Frames of earlier runs come before 0. Between two runs a chair may have been moved.
  bool is_of_earlier_run(int i) const { return at(i).frame_index < 0; }

  // With itself: all.
  std::unordered_map<KeyframeId, int> shared_landmarks(const Keyframe& keyframe) const {
    std::unordered_map<KeyframeId, int> shared = {{keyframe.id, 0}};
    for (const LandmarkId l : landmarks_of(keyframe)) {
      for (const Observation& o : map_.landmark(l)->observations) ++shared[o.keyframe];
    }
    return shared;
  }

  const Map& map_;
  Keyframes in_time_;
  std::unordered_map<KeyframeId, int> position_of_;
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

// Of two: more stands elsewhere. Any is worse than none.
bool is_worse(const MisplacedView& a, const MisplacedView& b) {
  return (b.frame_index < 0 && a.frame_index >= 0) || a.share() > b.share();
}

}  // namespace

bool MisplacedView::is_significant() const {
  return share() >= kOfAWrongMap && deviations_above(kOfARightMap, elsewhere, landmarks) >= kDeviations;
}

MisplacedView most_misplaced_view(const Map& map, const MatchOptions& matching, int threads) {
  const AlikeKeyframes keyframes(map);
  std::vector<MisplacedView> views(keyframes.size());
  parallel_for(keyframes.size(), threads, [&](int i) {
    for (const Keyframe* other : keyframes.most_alike(i)) {
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
