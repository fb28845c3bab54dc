#include "mapping/off_body.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "common/angles.h"
#include "common/median.h"
#include "common/nearest_vote.h"
#include "descriptor_tracks.h"
#include "geometry/triangulation.h"
#include "keyframe_landmarks.h"
#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

namespace {

using Keyframes = std::vector<const Keyframe*>;

// Fewer views, or views from about the same side, find a point that agrees with them.
constexpr std::size_t kFewestViews = 4;
constexpr double kLeastTurn = 8 * kDegree;
// px at 640 px (image_scale): beyond is a wrong match, not a point that sways.
constexpr double kWrongMatchPx = 10;
// Times the usual error: of the tracks of one body one in five, by wrong matches among them.
constexpr double kTimesUsual = 3;
// Of which one in five is off by chance, eight and more are in one of 250.
constexpr std::size_t kVotingTracks = 15;
constexpr double kLeastShare = 1.0 / 30, kMostShare = 0.5;

struct FittedTrack {
  FeatureTrack track;
  double error = 0;  // the median of its views, px at 640 px
};

// How far it is from the one point that explains it best; false of what tells nothing.
bool fit(const Keyframes& in_time, const FeatureTrack& track, double* error) {
  if (track.size() < kFewestViews) return false;
  std::vector<Rigid3> cameras_from_map;
  std::vector<Eigen::Vector3d> bearings;
  for (const auto& [k, feature] : track) {
    cameras_from_map.push_back(in_time[k]->camera_from_map);
    bearings.push_back(in_time[k]->image->set.bearings[feature]);
  }
  Eigen::Vector3d x_in_map;
  if (!triangulate_multi_view(cameras_from_map, bearings, &x_in_map)) return false;
  std::vector<double> errors;
  double least_cosine = 1;
  const Eigen::Vector3d first = (in_time[track.front().first]->center_in_map() - x_in_map).normalized();
  for (const auto& [k, feature] : track) {
    const ImageFeatures& image = *in_time[k]->image;
    errors.push_back(reprojection_error(image, feature, in_time[k]->camera_from_map * x_in_map).norm() /
                     image_scale(image.camera));
    least_cosine = std::min(least_cosine, first.dot((in_time[k]->center_in_map() - x_in_map).normalized()));
  }
  *error = median(std::move(errors));
  return least_cosine < std::cos(kLeastTurn) && *error < kWrongMatchPx;
}

std::vector<FittedTrack> fitted_tracks(const Keyframes& in_time, const FeatureTracks& tracks) {
  std::vector<FittedTrack> fitted;
  for (const FeatureTrack& track : tracks.all()) {
    FittedTrack candidate{track};
    if (fit(in_time, track, &candidate.error)) fitted.push_back(std::move(candidate));
  }
  return fitted;
}

double usual_error(const std::vector<FittedTrack>& tracks) {
  std::vector<double> errors;
  for (const FittedTrack& t : tracks) errors.push_back(t.error);
  return median(std::move(errors));
}

// A feature of a keyframe that is on a track, and whether that is off the body.
struct Voter {
  Eigen::Vector2f pixel;
  bool is_off = false;
};

std::vector<std::vector<Voter>> voters_of(const Keyframes& in_time, const std::vector<FittedTrack>& tracks) {
  const double limit = kTimesUsual * usual_error(tracks);
  std::vector<std::vector<Voter>> voters(in_time.size());
  for (const FittedTrack& t : tracks) {
    for (const auto& [k, feature] : t.track)
      voters[k].push_back({in_time[k]->image->set.features[feature].pixel, t.error > limit});
  }
  return voters;
}

bool is_off(const std::vector<Voter>& voters, const Eigen::Vector2f& pixel) {
  DistantVotes votes;
  for (const Voter& v : voters) votes.emplace_back((v.pixel - pixel).squaredNorm(), v.is_off);
  return most_of_nearest(kVotingTracks, std::move(votes));
}

}  // namespace

KeyframeFeatures features_off_body(const Map& map, const MatchOptions& matching, const IsLeftOut& is_left_out,
                                   int threads) {
  const Keyframes in_time = keyframes_in_time(map);
  const std::vector<std::vector<Voter>> voters = voters_of(
      in_time, fitted_tracks(in_time, tracks_by_descriptors(in_time, matching, is_left_out, threads)));
  KeyframeFeatures off;
  std::size_t observations = 0, observations_off = 0;
  for (std::size_t k = 0; k < in_time.size(); ++k) {
    const Keyframe& keyframe = *in_time[k];
    std::vector<char>& flags = off[keyframe.id];
    for (int f = 0; f < keyframe.image->size(); ++f) {
      flags.push_back(is_off(voters[k], keyframe.image->set.features[f].pixel));
      if (keyframe.landmark_of_feature[f] == kNoLandmark) continue;
      ++observations;
      observations_off += flags.back();
    }
  }
  const double share =
      observations == 0 ? 0 : static_cast<double>(observations_off) / static_cast<double>(observations);
  return share < kLeastShare || share > kMostShare ? KeyframeFeatures() : off;
}

}  // namespace mono_pose_tracker
