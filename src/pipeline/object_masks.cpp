#include "object_masks.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "common/statistics.h"
namespace mono_pose_tracker {

namespace {

std::vector<MotionTrack> outvoted(const std::vector<MotionTrack>& tracks, std::size_t voters) {
  std::vector<MotionTrack> smooth = tracks;
  for (MotionTrack& track : smooth) {
    DistantVotes near;
    for (const MotionTrack& t : tracks) near.emplace_back((t.from - track.from).squaredNorm(), t.is_other);
    track.is_other = most_of_nearest(voters, std::move(near));
  }
  return smooth;
}

bool show_both(const std::vector<MotionTrack>& tracks, int min_features) {
  const auto others = std::count_if(tracks.begin(), tracks.end(), [](const auto& t) { return t.is_other; });
  return others >= min_features;
}

}  // namespace

ObjectMasks::ObjectMasks(const std::vector<MotionTrack>& tracks, std::shared_ptr<const ObjectMasks> within,
                         const ObjectMasksOptions& options)
    : within_(std::move(within)) {
  for (const MotionTrack& track : tracks) spans_[track.from_index].push_back(track);
  for (auto span = spans_.begin(); span != spans_.end();) {
    span->second = outvoted(span->second, options.voters);
    span = show_both(span->second, options.min_features) ? std::next(span) : spans_.erase(span);
  }
}

bool ObjectMasks::show(std::int64_t index) const {
  const auto span = spans_.upper_bound(index);
  if (span == spans_.begin()) return false;
  const std::vector<MotionTrack>& tracks = std::prev(span)->second;
  return std::any_of(tracks.begin(), tracks.end(),
                     [&](const MotionTrack& track) { return index <= track.to_index; });
}

ObjectPoints ObjectMasks::at(std::int64_t index) const {
  auto span = spans_.upper_bound(index);
  if (span != spans_.begin()) --span;
  ObjectPoints objects;
  for (const MotionTrack& track : span->second) {
    const auto frames = static_cast<float>(track.to_index - track.from_index);
    const float on = std::clamp(static_cast<float>(index - track.from_index) / frames, 0.0F, 1.0F);
    const Eigen::Vector2f pixel = (1 - on) * track.from + on * track.to;
    (track.is_other ? objects.other : objects.object).emplace_back(pixel.x(), pixel.y());
  }
  return objects;
}

cv::Mat ObjectMasks::mask(std::int64_t index, const cv::Size& size) const {
  const ObjectPoints objects = at(index);
  const cv::Mat1f from_other = distances_from(objects.other, size);
  cv::Mat mask = from_other <= reach_of(objects.other);
  mask &= from_other < distances_from(objects.object, size);
  if (within_) mask &= within_->mask(index, size);
  return mask;
}

}  // namespace mono_pose_tracker
