#include "mono_pose_tracker/mapping/misplaced_view.h"

#include <cstddef>
#include <cstdlib>
#include <unordered_map>
#include <vector>

#include "keyframe_landmarks.h"
#include "mono_pose_tracker/common/parallel.h"
#include "mono_pose_tracker/mapping/contradiction.h"
#include "mono_pose_tracker/mapping/place_index.h"

namespace mono_pose_tracker {

namespace {

// Of what a keyframe sees: two that share as much are where they should be, beside each other.
constexpr double kWellTied = 1.0 / 3;
// The place index's score, below which a quarter of the landmarks at most is found again: they look alike by
// little, and of what is found one match in three may be wrong.
constexpr double kAlike = 0.02;

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

  // Null where none is.
  const Keyframe* most_alike(int i) const {
    const std::unordered_map<KeyframeId, int> shared = shared_landmarks(at(i));
    const double well_tied = kWellTied * shared.at(at(i).id);
    const auto is_asked = [&](KeyframeId id) {
      const auto tied = shared.find(id);
      return std::abs(position_of_.at(id) - i) > 1 && (tied == shared.end() || tied->second < well_tied);
    };
    const std::vector<PlaceMatch> best = index_.query(at(i).image->set, 1, is_asked);
    return best.empty() || best.front().score < kAlike ? nullptr : map_.keyframe(best.front().id);
  }

 private:
  // With itself: all.
  std::unordered_map<KeyframeId, int> shared_landmarks(const Keyframe& keyframe) const {
    std::unordered_map<KeyframeId, int> shared = {{keyframe.id, 0}};
    for (const LandmarkId l : landmarks_of(keyframe)) {
      for (const Observation& o : map_.landmark(l)->observations) ++shared[o.keyframe];
    }
    return shared;
  }

  const Map& map_;
  std::vector<const Keyframe*> in_time_;
  std::unordered_map<KeyframeId, int> position_of_;
  PlaceIndex index_;
};

MisplacedView compare(const Map& map, const CameraModel& camera, const Keyframe& other, const Keyframe& own,
                      const MatchOptions& matching) {
  const std::vector<Match> matches =
      match_descriptors(other.image->set.descriptors, own.image->set.descriptors, matching);
  MisplacedView view;
  view.frame_index = own.frame_index;
  view.other_frame_index = other.frame_index;
  view.landmarks = static_cast<int>(landmarks_of(other).size());
  view.elsewhere = contradiction_between(map, camera, other, own, matches).contradicting;
  return view;
}

}  // namespace

MisplacedView most_misplaced_view(const Map& map, const CameraModel& camera, const MatchOptions& matching,
                                  int threads) {
  const AlikeKeyframes keyframes(map);
  std::vector<MisplacedView> views(keyframes.size());
  parallel_for(keyframes.size(), threads, [&](int i) {
    const Keyframe* other = keyframes.most_alike(i);
    if (other) views[i] = compare(map, camera, *other, keyframes.at(i), matching);
  });
  MisplacedView worst;
  for (const MisplacedView& view : views) {
    const bool is_first = worst.frame_index < 0 && view.frame_index >= 0;
    if (is_first || view.share() > worst.share()) worst = view;
  }
  return worst;
}

}  // namespace mono_pose_tracker
