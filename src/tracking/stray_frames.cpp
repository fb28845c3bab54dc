#include "stray_frames.h"

#include <algorithm>
#include <utility>

#include "common/median.h"
#include "common/time_stamp.h"
#include "motion_smoothing.h"

namespace mono_pose_tracker {

namespace {

// Out and back again at ten times the speed of the frames about it: held in a hand at 0.5 m/s and 30 Hz, a
// hundred and fifty m/s^2.
constexpr double kTimesFaster = 10;
constexpr std::size_t kAbout = 10;      // frames before and after that tell the speed
constexpr std::size_t kLeastSteps = 6;  // of these: fewer tell none
constexpr std::size_t kShortRun = 2;
constexpr std::size_t kMostInRun = 60;  // a second at 60 Hz
// Of a run of more than two: the steps into it and out of it over the longest within. A hand that reaches out
// and back within a second does not do so in one step.
constexpr double kTimesLonger = 3;
constexpr double kLongestS = 1;  // from before a run to after it: what stays away longer may be there

double distance(const RegisteredFrame& a, const RegisteredFrame& b) {
  return (a.map_from_camera.translation - b.map_from_camera.translation).norm();
}

// The usual speed about frames [first, last], in units a second, without them; negative when nothing tells.
double speed_about(const std::vector<RegisteredFrame>& frames, std::size_t first, std::size_t last) {
  std::vector<double> speeds;
  const std::size_t end = std::min(last + kAbout, frames.size() - 1);
  for (std::size_t i = first > kAbout ? first - kAbout : 0; i < end; ++i) {
    const double seconds = seconds_between(frames[i].stamp_ns, frames[i + 1].stamp_ns);
    if ((i + 1 >= first && i <= last) || seconds <= 0) continue;
    speeds.push_back(distance(frames[i], frames[i + 1]) / seconds);
  }
  return speeds.size() < kLeastSteps ? -1 : median(std::move(speeds));
}

// The camera steps into the run and out of it, and hardly moves between.
bool is_entered_by_a_jump(const std::vector<RegisteredFrame>& frames, std::size_t first, std::size_t last) {
  double within = 0;
  for (std::size_t i = first; i < last; ++i) within = std::max(within, distance(frames[i], frames[i + 1]));
  return distance(frames[first - 1], frames[first]) > kTimesLonger * within &&
         distance(frames[last], frames[last + 1]) > kTimesLonger * within;
}

// Whether the run of frames is where nothing before and after leads.
bool is_astray(const std::vector<RegisteredFrame>& frames, std::size_t first, std::size_t last,
               double least) {
  const RegisteredFrame &before = frames[first - 1], &after = frames[last + 1];
  const double speed = speed_about(frames, first, last);
  const double seconds = seconds_between(before.stamp_ns, after.stamp_ns);
  if (speed < 0 || seconds <= 0) return false;
  const double limit = std::max(least, 0.5 * kTimesFaster * speed * seconds);
  if (distance(before, after) > limit) return false;
  for (std::size_t i = first; i <= last; ++i) {
    if (distance(before, frames[i]) <= limit || distance(after, frames[i]) <= limit) return false;
  }
  return true;
}

// Whether no camera moves into a longer run nor out of it, while past it the way goes on.
bool is_elsewhere(const std::vector<RegisteredFrame>& frames, std::size_t first, std::size_t last,
                  const MotionPrior& prior, double least) {
  if (first < 2 || last + 2 >= frames.size()) return false;
  if (seconds_between(frames[first - 1].stamp_ns, frames[last + 1].stamp_ns) > kLongestS) return false;
  const auto is_beyond = [&](std::size_t a, std::size_t b, std::size_t c) {
    const auto center = [&](std::size_t i) {
      return TimedCenter{frames[i].stamp_ns, frames[i].map_from_camera.translation};
    };
    return prior.is_beyond({center(a), center(b), center(c)}, least);
  };
  return is_beyond(first - 2, first - 1, first) && is_beyond(last, last + 1, last + 2) &&
         !is_beyond(first - 2, first - 1, last + 1) && !is_beyond(first - 1, last + 1, last + 2) &&
         is_entered_by_a_jump(frames, first, last);
}

// Frames that fit into that time.
std::size_t longest_run(const std::vector<RegisteredFrame>& frames) {
  std::size_t longest = kShortRun;
  for (std::size_t first = 0, last = 0; last < frames.size(); ++last) {
    while (seconds_between(frames[first].stamp_ns, frames[last].stamp_ns) > kLongestS) ++first;
    longest = std::max(longest, last - first);
  }
  return std::min(longest, kMostInRun);
}

}  // namespace

std::set<std::int64_t> stray_frames(std::vector<RegisteredFrame> frames, double least) {
  std::set<std::int64_t> strays;
  const MotionPrior prior(centers_of(frames));
  const std::size_t longest = longest_run(frames);
  // What is known to be astray tells nothing of the others.
  for (std::size_t length = 1; length <= longest; ++length) {
    for (std::size_t first = 1; first + length < frames.size();) {
      const std::size_t last = first + length - 1;
      if (!(length <= kShortRun ? is_astray(frames, first, last, least)
                                : is_elsewhere(frames, first, last, prior, least))) {
        ++first;
        continue;
      }
      const auto begin = frames.begin() + static_cast<std::ptrdiff_t>(first);
      const auto end = begin + static_cast<std::ptrdiff_t>(length);
      for (auto frame = begin; frame != end; ++frame) strays.insert(frame->index);
      frames.erase(begin, end);
    }
  }
  return strays;
}

}  // namespace mono_pose_tracker
