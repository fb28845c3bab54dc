#include "mapping/static_background.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "common/statistics.h"
#include "common/threads.h"
#include "keyframe_landmarks.h"
#include "mapping/feature_tracks.h"

namespace mono_pose_tracker {

namespace {

// Displacement of a matched feature between the images, px at 640 px (image_scale).
double shift_px(const ImageFeatures& first, const ImageFeatures& second, const Match& m) {
  return (second.set.features[m.second].pixel - first.set.features[m.first].pixel).norm() /
         image_scale(first.camera);
}

// Features at the left, right, upper and lower side of the image.
std::array<int, 4> count_at_sides(const std::vector<cv::Point2f>& pixels, const CameraModel& camera,
                                  double side) {
  std::array<int, 4> count{};
  for (const cv::Point2f& p : pixels) {
    count[0] += p.x < side * camera.width();
    count[1] += p.x > (1 - side) * camera.width();
    count[2] += p.y < side * camera.height();
    count[3] += p.y > (1 - side) * camera.height();
  }
  return count;
}

// Shares of the images in which static features reach around the moving ones, and vice versa.
struct SharesRound {
  double still = 0, moving = 0;
};

SharesRound shares_round(const CameraModel& camera, const std::vector<MotionTrack>& tracks) {
  std::map<std::int64_t, std::array<std::vector<cv::Point2f>, 2>> places;  // static and moving, by image
  for (const MotionTrack& t : tracks) places[t.from_index][t.is_other].emplace_back(t.from.x(), t.from.y());
  if (places.empty()) return {};
  SharesRound shares;
  for (const auto& entry : places) {
    const auto& [still, moving] = entry.second;
    shares.still += reaches_round(still, moving, camera);
    shares.moving += reaches_round(moving, still, camera);
  }
  const auto count = static_cast<double>(places.size());
  return {shares.still / count, shares.moving / count};
}

}  // namespace

// Counts for each track how often it kept its place (pro) and how often it left it (contra).
class StaticSegmentation::Votes {
 public:
  explicit Votes(const StaticSegmentation& all) : options_(all.options_), of_tracks_(all.images_) {
    for (const int apart : options_.image_distances) {  // near images join tracks first
      for (int k = 0; k + apart < all.size(); ++k) {
        const auto matched = all.matches_.find({k, k + apart});
        if (matched != all.matches_.end()) add(all.images_, matched->first, matched->second);
      }
    }
    of_tracks_.sum_over_tracks();
  }

  FeatureMotion side(int image, int feature) const {
    const TrackVotes::Count& count = of_tracks_.of(image, feature);
    if (count.contra > count.pro) return FeatureMotion::kTurns;
    const bool is_still =
        count.pro >= options_.min_static_pairs && count.pro >= options_.static_per_moved * count.contra;
    return is_still ? FeatureMotion::kMovesOtherwise : FeatureMotion::kUnknown;
  }

 private:
  void add(const std::vector<SeenImage>& images, const std::pair<int, int>& pair,
           const std::vector<Match>& matches) {
    const auto [first, second] = pair;
    std::vector<double> shifts;
    for (const Match& m : matches) shifts.push_back(shift_px(*images[first].image, *images[second].image, m));
    const auto moved =
        std::count_if(shifts.begin(), shifts.end(), [&](double shift) { return shift > options_.moved_px; });
    // Without motion, static features are no evidence.
    const bool is_evidence = moved >= options_.min_features;
    for (std::size_t i = 0; i < matches.size(); ++i) {
      const bool is_static = is_evidence && shifts[i] < options_.static_px;
      const bool has_moved = shifts[i] > options_.moved_px;
      of_tracks_.join(first, matches[i].first, second, matches[i].second);
      of_tracks_.add(first, matches[i].first, {is_static, has_moved});
    }
  }

  const MotionSegmentationOptions& options_;
  TrackVotes of_tracks_;
};

// Matches all images this far apart that are not matched yet.
void StaticSegmentation::match(int apart) {
  std::vector<int> unknown;
  for (int k = 0; k + apart < size(); ++k) {
    if (matches_.emplace(std::make_pair(k, k + apart), std::vector<Match>()).second) unknown.push_back(k);
  }
  std::vector<std::vector<Match>> matched(unknown.size());
  parallel_for(static_cast<int>(unknown.size()), options_.threads, [&](int u) {
    matched[u] = raw_matches(graph_, images_[unknown[u]], images_[unknown[u] + apart], options_.matching);
  });
  for (std::size_t u = 0; u < unknown.size(); ++u)
    matches_[{unknown[u], unknown[u] + apart}] = std::move(matched[u]);
}

// Whether enough neighbouring images have enough static matches; most recordings fail this test.
bool StaticSegmentation::may_exist(const LeastStill& least) const {
  std::vector<double> still;
  for (int k = 0; k + 1 < size(); ++k) {
    const std::vector<Match>& matches = matches_.at({k, k + 1});
    still.push_back(static_cast<double>(std::count_if(matches.begin(), matches.end(), [&](const Match& m) {
      return shift_px(*images_[k].image, *images_[k + 1].image, m) < options_.static_px;
    })));
  }
  return median(std::move(still)) >= least.features;
}

// Classifies the matches of neighbouring images that are certain.
StaticBackground StaticSegmentation::classify(const Votes& votes, const LeastStill& least,
                                              bool object_turns) const {
  StaticBackground background;
  for (int k = 0; k < size(); ++k) {
    background.sides.emplace_back();
    for (int f = 0; f < images_[k].image->size(); ++f) background.sides[k].push_back(votes.side(k, f));
  }
  std::vector<double> still, moving, all;
  for (int k = 0; k + 1 < size(); ++k) {
    std::array<int, 2> count{};
    const std::vector<Match>& matches = matches_.at({k, k + 1});
    for (const Match& m : matches) {
      const FeatureMotion side = background.sides[k][m.first];
      if (side == FeatureMotion::kUnknown) continue;
      const bool moves = side == FeatureMotion::kTurns;
      ++count[moves];
      background.tracks.push_back({images_[k].frame_index, images_[k + 1].frame_index,
                                   images_[k].image->set.features[m.first].pixel,
                                   images_[k + 1].image->set.features[m.second].pixel, moves});
    }
    still.push_back(count[0]);
    moving.push_back(count[1]);
    all.push_back(static_cast<double>(matches.size()));
  }
  const double median_still = median(std::move(still));
  const SharesRound round = shares_round(images_.front().image->camera, background.tracks);
  background.exists =
      median_still >= least.features && median_still >= least.share * median(std::move(all)) &&
      median(std::move(moving)) >= options_.min_features && (object_turns || round.moving <= 0.5);
  background.reaches_round = round.still > 0.5;
  return background;
}

StaticBackground StaticSegmentation::find(const LeastStill& least, bool object_turns) {
  match(options_.image_distances[0]);
  if (!may_exist(least)) return {};
  for (const int apart : options_.image_distances) match(apart);
  return classify(Votes(*this), least, object_turns);
}

bool reaches_round(const std::vector<cv::Point2f>& first, const std::vector<cv::Point2f>& second,
                   const CameraModel& camera) {
  constexpr ImageSidesOptions options{};
  const std::array<int, 4> of_first = count_at_sides(first, camera, options.side);
  const std::array<int, 4> of_second = count_at_sides(second, camera, options.side);
  int sides_of_first = 0, sides_of_second = 0;
  for (std::size_t i = 0; i < of_first.size(); ++i) {
    sides_of_first += of_first[i] >= options.min_features && of_first[i] > of_second[i];
    sides_of_second += of_second[i] >= options.min_features && of_second[i] >= of_first[i];
  }
  return sides_of_first > sides_of_second;
}

std::vector<SeenImage> images_in_time(const Map& map) {
  std::vector<SeenImage> images;
  for (const Keyframe* keyframe : keyframes_in_time(map))
    images.push_back({keyframe->frame_index, keyframe->image});
  return images;
}

}  // namespace mono_pose_tracker
