#include "stray_frames.h"

#include <algorithm>
#include <utility>

#include "mono_pose_tracker/common/median.h"

namespace mono_pose_tracker {

namespace {

// Out and back again at ten times the speed of the frames about it: held in a hand at 0.5 m/s and 30 Hz, a
// hundred and fifty m/s^2.
constexpr double kTimesFaster = 10;
constexpr std::size_t kAbout = 10;      // frames before and after that tell the speed
constexpr std::size_t kLeastSteps = 6;  // of these: fewer tell none
constexpr std::size_t kLongestRun = 2;

double distance(const PosedFrame& a, const PosedFrame& b) {
  return (a.map_from_camera.translation - b.map_from_camera.translation).norm();
}

double seconds_between(const PosedFrame& a, const PosedFrame& b) {
  return 1e-9 * static_cast<double>(b.stamp_ns - a.stamp_ns);
}

// The usual speed about frames [first, last], in units a second, without them; negative when nothing tells.
double speed_about(const std::vector<PosedFrame>& frames, std::size_t first, std::size_t last) {
  std::vector<double> speeds;
  const std::size_t end = std::min(last + kAbout, frames.size() - 1);
  for (std::size_t i = first > kAbout ? first - kAbout : 0; i < end; ++i) {
    const double seconds = seconds_between(frames[i], frames[i + 1]);
    if ((i + 1 >= first && i <= last) || seconds <= 0) continue;
    speeds.push_back(distance(frames[i], frames[i + 1]) / seconds);
  }
  return speeds.size() < kLeastSteps ? -1 : median(std::move(speeds));
}

// Whether the run of frames is where nothing before and after leads.
bool is_astray(const std::vector<PosedFrame>& frames, std::size_t first, std::size_t last, double least) {
  const PosedFrame &before = frames[first - 1], &after = frames[last + 1];
  const double speed = speed_about(frames, first, last);
  const double seconds = seconds_between(before, after);
  if (speed < 0 || seconds <= 0) return false;
  const double limit = std::max(least, 0.5 * kTimesFaster * speed * seconds);
  if (distance(before, after) > limit) return false;
  for (std::size_t i = first; i <= last; ++i) {
    if (distance(before, frames[i]) <= limit || distance(after, frames[i]) <= limit) return false;
  }
  return true;
}

}  // namespace

std::set<std::int64_t> stray_frames(std::vector<PosedFrame> frames, double least) {
  std::set<std::int64_t> strays;
  // What is known to be astray tells nothing of the others.
  for (std::size_t length = 1; length <= kLongestRun; ++length) {
    for (std::size_t first = 1; first + length < frames.size();) {
      if (!is_astray(frames, first, first + length - 1, least)) {
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
