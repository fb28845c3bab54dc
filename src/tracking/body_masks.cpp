#include "body_masks.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "mono_pose_tracker/common/median.h"

namespace mono_pose_tracker {

namespace {

// A single wrong match amid the other body's features is outvoted by the nearest, itself among them.
constexpr std::size_t kVoters = 5;
// Fewer features than this tell nothing of where a body is.
constexpr int kFewest = 8;

std::vector<BodyTrack> outvoted(const std::vector<BodyTrack>& tracks) {
  std::vector<BodyTrack> smooth = tracks;
  std::vector<std::pair<float, bool>> near;
  for (BodyTrack& track : smooth) {
    near.clear();
    for (const BodyTrack& t : tracks) near.emplace_back((t.from - track.from).squaredNorm(), t.is_other);
    const auto voters = static_cast<std::ptrdiff_t>(std::min(kVoters, near.size()));
    std::partial_sort(near.begin(), near.begin() + voters, near.end());
    track.is_other =
        2 * std::count_if(near.begin(), near.begin() + voters, [](const auto& n) { return n.second; }) >
        voters;
  }
  return smooth;
}

bool show_both(const std::vector<BodyTrack>& tracks) {
  const auto others = std::count_if(tracks.begin(), tracks.end(), [](const auto& t) { return t.is_other; });
  return others >= kFewest;
}

// Distance of each pixel from the nearest of the points, px.
cv::Mat1f distances(const std::vector<Eigen::Vector2f>& points, const cv::Size& size) {
  cv::Mat1b places(size, 255);
  for (const Eigen::Vector2f& p : points) {
    const cv::Point pixel(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
    if (cv::Rect(cv::Point(), size).contains(pixel)) places(pixel) = 0;
  }
  cv::Mat1f distance;
  cv::distanceTransform(places, distance, cv::DIST_L2, cv::DIST_MASK_5);
  return distance;
}

// Beyond its outermost features a body goes on by a part of its size, and what is there is nobody's.
float reach_of(const std::vector<Eigen::Vector2f>& points) {
  std::vector<double> x, y, away;
  for (const Eigen::Vector2f& p : points) x.push_back(p.x()), y.push_back(p.y());
  const Eigen::Vector2f middle(static_cast<float>(median(x)), static_cast<float>(median(y)));
  for (const Eigen::Vector2f& p : points) away.push_back((p - middle).norm());
  return static_cast<float>(median(std::move(away)) / 2);
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

BodiesInImage BodyMasks::at(std::int64_t index) const {
  auto span = spans_.upper_bound(index);
  if (span != spans_.begin()) --span;
  BodiesInImage bodies;
  for (const BodyTrack& track : span->second) {
    const auto frames = static_cast<float>(track.to_index - track.from_index);
    const float on = std::clamp(static_cast<float>(index - track.from_index) / frames, 0.0F, 1.0F);
    (track.is_other ? bodies.of_other : bodies.of_map).push_back((1 - on) * track.from + on * track.to);
  }
  return bodies;
}

cv::Mat BodyMasks::mask(std::int64_t index, const cv::Size& size) const {
  const BodiesInImage bodies = at(index);
  const cv::Mat1f other = distances(bodies.of_other, size);
  cv::Mat mask = other <= reach_of(bodies.of_other);
  if (!bodies.of_map.empty()) mask &= other < distances(bodies.of_map, size);
  if (within_) mask &= within_->mask(index, size);
  return mask;
}

}  // namespace mono_pose_tracker
