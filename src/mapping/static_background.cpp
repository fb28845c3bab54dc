#include "mapping/static_background.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "common/median.h"
#include "feature_tracks.h"
#include "mapping/image_sides.h"
#include "match_shift.h"

namespace mono_pose_tracker {

namespace {

// Distances between compared images: neighbours have most matches, distant ones show best what has moved.
constexpr std::array<int, 5> kFartherApart = {2, 4, 8, 16, 32};
// px at 640 px (image_scale). Up to the first limit a feature has kept its place, with noise, JPEG and a
// vibrating tripod; from the second on it has moved.
constexpr double kStillPx = 1, kMovedPx = 3;
// Image pairs that show a track in its place: one or two may be wrong matches, as one match of five may be
// wrong.
constexpr int kMinStill = 3;
constexpr int kStillPerMoved = 4;
constexpr double kMinMovingFeatures = 25;  // fewer cannot make a map

using Images = std::vector<SeenImage>;

// Whether enough neighbouring images have enough static matches; most recordings fail this test.
bool may_be_still(const Images& images, const MatchesInTime& in_time, const LeastStill& least) {
  std::vector<double> still;
  for (std::size_t k = 0; k < in_time.size(); ++k) {
    int count = 0;
    for (const Match& m : in_time[k]) count += shift_px(*images[k].image, *images[k + 1].image, m) < kStillPx;
    still.push_back(count);
  }
  return median(std::move(still)) >= least.features;
}

// Counts for each track how often it kept its place and how often it left it.
class Evidence {
 public:
  explicit Evidence(const Images& images) : images_(images), tracks_(feature_counts(images)) {
    for (const SeenImage& seen : images) of_feature_.emplace_back(seen.image->size());
  }

  void add(const MatchesInTime& matches, int apart) {
    for (int k = 0; k < static_cast<int>(matches.size()); ++k) add(matches[k], k, k + apart);
  }

  void sum_over_tracks() {
    for (const FeatureTrack& track : tracks_.all()) {
      Count sum;
      for (const auto& [image, feature] : track) {
        sum.still += of_feature_[image][feature].still;
        sum.moved += of_feature_[image][feature].moved;
      }
      for (const auto& [image, feature] : track) of_feature_[image][feature] = sum;
    }
  }

  FeatureMotion side(std::size_t image, int feature) const {
    const Count& count = of_feature_[image][feature];
    if (count.moved > count.still) return FeatureMotion::kTurns;
    const bool is_still = count.still >= kMinStill && count.still >= kStillPerMoved * count.moved;
    return is_still ? FeatureMotion::kMovesOtherwise : FeatureMotion::kUnknown;
  }

 private:
  struct Count {
    int still = 0, moved = 0;
  };

  void add(const std::vector<Match>& matches, int first, int second) {
    std::vector<double> shifts;
    for (const Match& m : matches)
      shifts.push_back(shift_px(*images_[first].image, *images_[second].image, m));
    const auto moved =
        std::count_if(shifts.begin(), shifts.end(), [](double shift) { return shift > kMovedPx; });
    // Without motion, static features are no evidence.
    const bool tells = moved >= kMinMovingFeatures;
    for (std::size_t i = 0; i < matches.size(); ++i) {
      tracks_.join(first, matches[i].first, second, matches[i].second);
      Count& count = of_feature_[first][matches[i].first];
      count.still += tells && shifts[i] < kStillPx;
      count.moved += shifts[i] > kMovedPx;
    }
  }

  const Images& images_;
  FeatureTracks tracks_;
  std::vector<std::vector<Count>> of_feature_;
};

// Shares of the images in which static features reach around the moving ones, and vice versa.
struct SharesRound {
  double still = 0, moving = 0;
};

SharesRound shares_round(const Images& images, const std::vector<MotionTrack>& tracks) {
  std::map<std::int64_t, std::array<std::vector<cv::Point2f>, 2>> places;  // static and moving, by image
  for (const MotionTrack& t : tracks) places[t.from_index][t.is_other].emplace_back(t.from.x(), t.from.y());
  if (places.empty()) return {};
  const CameraModel& camera = images.front().image->camera;
  SharesRound shares;
  for (const auto& entry : places) {
    const auto& [still, moving] = entry.second;
    shares.still += reaches_round(still, moving, camera);
    shares.moving += reaches_round(moving, still, camera);
  }
  const auto count = static_cast<double>(places.size());
  return {shares.still / count, shares.moving / count};
}

// Classifies the matches of neighbouring images that are certain.
StaticBackground classify(const Images& images, const MatchesInTime& in_time, const Evidence& evidence,
                          const LeastStill& least, bool object_turns) {
  StaticBackground background;
  for (std::size_t k = 0; k < images.size(); ++k) {
    background.sides.emplace_back();
    for (int f = 0; f < images[k].image->size(); ++f) background.sides[k].push_back(evidence.side(k, f));
  }
  std::vector<double> still, moving, all;
  for (std::size_t k = 0; k < in_time.size(); ++k) {
    std::array<int, 2> count{};
    for (const Match& m : in_time[k]) {
      const FeatureMotion side = background.sides[k][m.first];
      if (side == FeatureMotion::kUnknown) continue;
      const bool moves = side == FeatureMotion::kTurns;
      ++count[moves];
      background.tracks.push_back({images[k].frame_index, images[k + 1].frame_index,
                                   images[k].image->set.features[m.first].pixel,
                                   images[k + 1].image->set.features[m.second].pixel, moves});
    }
    still.push_back(count[0]);
    moving.push_back(count[1]);
    all.push_back(static_cast<double>(in_time[k].size()));
  }
  const double median_still = median(std::move(still));
  const SharesRound round = shares_round(images, background.tracks);
  background.exists =
      median_still >= least.features && median_still >= least.share * median(std::move(all)) &&
      median(std::move(moving)) >= kMinMovingFeatures && (object_turns || round.moving <= 0.5);
  background.reaches_round = round.still > 0.5;
  return background;
}

}  // namespace

StaticBackground find_static_background(const std::vector<SeenImage>& images, const MatchesInTime& in_time,
                                        const MatchOptions& matching, const LeastStill& least,
                                        bool object_turns, int threads) {
  if (!may_be_still(images, in_time, least)) return {};
  Evidence evidence(images);
  evidence.add(in_time, 1);
  for (const int apart : kFartherApart) {
    evidence.add(match_in_time(images, matching, threads, apart), apart);
  }
  evidence.sum_over_tracks();
  return classify(images, in_time, evidence, least, object_turns);
}

}  // namespace mono_pose_tracker
