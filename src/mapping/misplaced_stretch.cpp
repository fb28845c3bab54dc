#include "mono_pose_tracker/mapping/misplaced_stretch.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "held_keyframe.h"
#include "keyframe_landmarks.h"
#include "mono_pose_tracker/mapping/contradiction.h"
#include "mono_pose_tracker/mapping/in_view.h"
#include "mono_pose_tracker/mapping/seam.h"
#include "mono_pose_tracker/mapping/second_motion.h"
#include "span_in_time.h"

namespace mono_pose_tracker {

namespace {

using Keyframes = std::vector<const Keyframe*>;

// From `begin` to before `end`, in the order of time.
struct Stretch {
  std::size_t begin = 0, end = 0;
  bool is_of_motion = false;  // the break at one of its ends is
  std::size_t size() const { return end - begin; }
};

// What lies between two keyframes that follow each other.
struct Break {
  std::size_t after = 0;          // the second of them, in the order of time
  bool contradicts = false;       // by its landmarks
  bool most_contradicts = false;  // most of them
  bool is_of_motion = false;      // most of what is seen moves otherwise, though few landmarks tell it

  // Most of what is seen is elsewhere: of the two poses one is wrong.
  bool is_whole() const { return most_contradicts || is_of_motion; }
};

constexpr double kMostOfSeen = 0.5;
constexpr double kMostOfMap = 0.25;  // what was followed for a while
// The same, where what is before and after it does not show what moved: it may be half as long as they are.
constexpr double kMostOfHealed = 1.0 / 3;

// Whether most of what two keyframes have in common has moved as one in another way than their poses say:
// features that are no landmark of both as well. A hand that comes before a head brings its own.
bool most_moves_otherwise(const Keyframe& first, const Keyframe& second, const std::vector<Match>& matches,
                          const RansacOptions& ransac) {
  const auto most = [&](auto count) {
    return static_cast<double>(count) > kMostOfSeen * static_cast<double>(matches.size());
  };
  const PosedImage image1 = posed_image(first), image2 = posed_image(second);
  // Off their lines: what is far contradicts by meeting behind the cameras. And nearly always it is answered
  // without a second motion being looked for.
  if (!most(count_off_epipolar_lines(matches, image1, image2, ransac))) return false;
  const PairMotions motions = motions_of(matches, image1, image2, ransac);
  return motions.has_other &&
         most(std::count(motions.obeyed.begin(), motions.obeyed.end(), ObeyedMotion::kOther));
}

// What moves otherwise all along the map is a second body, and no pose is wrong for it.
void leave_out_second_body(std::size_t pairs, std::vector<Break>* breaks) {
  const auto is_of_motion = [](const Break& b) { return b.is_of_motion; };
  const auto count = std::count_if(breaks->begin(), breaks->end(), is_of_motion);
  if (static_cast<double>(count) <= kMostOfMap * static_cast<double>(pairs)) return;
  for (Break& b : *breaks) b.is_of_motion = false;
  const auto is_none = [](const Break& b) { return !b.contradicts; };
  breaks->erase(std::remove_if(breaks->begin(), breaks->end(), is_none), breaks->end());
}

// By what either of the two sees of the map, in the other; and by all that they have in common.
std::vector<Break> breaks_in_time(const Map& map, const Keyframes& in_time, const MatchesInTime& matches,
                                  const RansacOptions& ransac) {
  // What fills the view may be of what is far for the most part, which a pose that is a little wrong
  // contradicts; an object is all there throughout.
  const bool is_object = mostly_stays_in_view(map);
  std::vector<Break> breaks;
  for (std::size_t i = 0; i + 1 < in_time.size(); ++i) {
    const Keyframe &first = *in_time[i], &second = *in_time[i + 1];
    const ContradictionBothWays between = contradiction_both_ways(map, first, second, matches[i]);
    const bool most_contradicts = std::max(between.onward.share(), between.back.share()) > kMostOfSeen;
    const bool is_of_motion =
        is_object && !most_contradicts && most_moves_otherwise(first, second, matches[i], ransac);
    const bool contradicts = between.is_significant();
    if (is_of_motion || contradicts) breaks.push_back({i + 1, contradicts, most_contradicts, is_of_motion});
  }
  leave_out_second_body(matches.size(), &breaks);
  return breaks;
}

// From one break to another of which one is whole, the shortest first.
std::vector<Stretch> stretches_between(const std::vector<Break>& breaks) {
  std::vector<Stretch> stretches;
  for (auto end = breaks.begin(); end != breaks.end(); ++end) {
    for (auto begin = breaks.begin(); begin != end; ++begin) {
      if (begin->is_whole() || end->is_whole())
        stretches.push_back({begin->after, end->after, begin->is_of_motion || end->is_of_motion});
    }
  }
  std::stable_sort(stretches.begin(), stretches.end(),
                   [](const Stretch& a, const Stretch& b) { return a.size() < b.size(); });
  return stretches;
}

// As firmly as a seam does.
bool holds_without(const Stretch& stretch, const std::vector<SpanInTime>& spans) {
  return std::count_if(spans.begin(), spans.end(), [&](const SpanInTime& span) {
           return span.ties(stretch.begin, stretch.end);
         }) >= Seam::kMinPoints;
}

bool may_go(const Map& map, const Keyframes& in_time, const Stretch& stretch) {
  const double most = stretch.is_of_motion ? kMostOfHealed : kMostOfMap;
  if (static_cast<double>(stretch.size()) > most * static_cast<double>(in_time.size())) return false;
  return std::none_of(in_time.begin() + static_cast<std::ptrdiff_t>(stretch.begin),
                      in_time.begin() + static_cast<std::ptrdiff_t>(stretch.end),
                      [&](const Keyframe* k) { return is_held(map, *k); });
}

// Who walks by before a camera moves otherwise from one keyframe to the next, and past one as well; what was
// followed does not, past all of it.
bool is_healed_without(const Keyframes& in_time, const Stretch& stretch, const MatchOptions& matching,
                       const RansacOptions& ransac) {
  if (!stretch.is_of_motion) return true;
  const Keyframe &before = *in_time[stretch.begin - 1], &after = *in_time[stretch.end];
  const auto matches =
      match_descriptors(before.image->set.descriptors, after.image->set.descriptors, matching);
  return !most_moves_otherwise(before, after, matches, ransac);
}

}  // namespace

std::set<KeyframeId> misplaced_stretch(const Map& map, const MatchesInTime& matches,
                                       const MatchOptions& matching, const RansacOptions& ransac) {
  const Keyframes in_time = keyframes_in_time(map);
  const std::vector<Stretch> stretches = stretches_between(breaks_in_time(map, in_time, matches, ransac));
  std::set<KeyframeId> misplaced;
  if (stretches.empty()) return misplaced;
  const std::vector<SpanInTime> spans = spans_in_time(map, in_time);
  for (const Stretch& stretch : stretches) {
    if (is_set(ransac.cancelled)) break;
    if (!may_go(map, in_time, stretch) || !holds_without(stretch, spans) ||
        !is_healed_without(in_time, stretch, matching, ransac)) {
      continue;
    }
    for (std::size_t i = stretch.begin; i < stretch.end; ++i) misplaced.insert(in_time[i]->id);
    break;
  }
  return misplaced;
}

}  // namespace mono_pose_tracker
