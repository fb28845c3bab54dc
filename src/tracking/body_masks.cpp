#include "body_masks.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "common/nearest_vote.h"
namespace mono_pose_tracker {

namespace {

// A single wrong match amid the other body's features is outvoted by the nearest, itself among them.
constexpr std::size_t kVoters = 5;
// Fewer features than this tell nothing of where a body is.
constexpr int kFewest = 8;

std::vector<BodyTrack> outvoted(const std::vector<BodyTrack>& tracks) {
  std::vector<BodyTrack> smooth = tracks;
  for (BodyTrack& track : smooth) {
    DistantVotes near;
    for (const BodyTrack& t : tracks) near.emplace_back((t.from - track.from).squaredNorm(), t.is_other);
    track.is_other = most_of_nearest(kVoters, std::move(near));
  }
  return smooth;
}

bool show_both(const std::vector<BodyTrack>& tracks) {
  const auto others = std::count_if(tracks.begin(), tracks.end(), [](const auto& t) { return t.is_other; });
  return others >= kFewest;
}

}  // namespace

BodyMasks::BodyMasks(const std::vector<BodyTrack>& tracks, std::shared_ptr<const BodyMasks> within)
    : within_(std::move(within)) {
  for (const BodyTrack& track : tracks) spans_[track.from_index].push_back(track);
  for (auto span = spans_.begin(); span != spans_.end();) {
    span->second = outvoted(span->second);
    span = show_both(span->second) ? std::next(span) : spans_.erase(span);
  }
}

bool BodyMasks::show(std::int64_t index) const {
  const auto span = spans_.upper_bound(index);
  if (span == spans_.begin()) return false;
  const std::vector<BodyTrack>& tracks = std::prev(span)->second;
  return std::any_of(tracks.begin(), tracks.end(),
                     [&](const BodyTrack& track) { return index <= track.to_index; });
}

ObjectPoints BodyMasks::at(std::int64_t index) const {
  auto span = spans_.upper_bound(index);
  if (span != spans_.begin()) --span;
  ObjectPoints bodies;
  for (const BodyTrack& track : span->second) {
    const auto frames = static_cast<float>(track.to_index - track.from_index);
    const float on = std::clamp(static_cast<float>(index - track.from_index) / frames, 0.0F, 1.0F);
    const Eigen::Vector2f pixel = (1 - on) * track.from + on * track.to;
    (track.is_other ? bodies.other : bodies.object).emplace_back(pixel.x(), pixel.y());
  }
  return bodies;
}

cv::Mat BodyMasks::mask(std::int64_t index, const cv::Size& size) const {
  const ObjectPoints bodies = at(index);
  const cv::Mat1f from_other = distances_from(bodies.other, size);
  cv::Mat mask = from_other <= reach_of(bodies.other);
  mask &= from_other < distances_from(bodies.object, size);
  if (within_) mask &= within_->mask(index, size);
  return mask;
}

}  // namespace mono_pose_tracker
