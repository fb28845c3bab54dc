#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>
#include <unordered_set>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/cancel_flag.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// A landmark that may be in view, with the descriptor of one of its observations. The descriptor points into
/// the candidate's image, which must outlive it.
struct LandmarkCandidate {
  LandmarkId id = kNoLandmark;
  Eigen::Vector3d x_in_map;
  const std::uint8_t* descriptor = nullptr;
  Eigen::Vector3d seen_from;        // unit, from the landmark to the camera that gave the descriptor
  double scale_times_distance = 0;  // px * map units; divided by the distance: the expected scale
  double focal_px = 1;              // of the camera to which this scale belongs
};

struct LandmarkMatch {
  int candidate = -1;
  int feature = -1;
  int distance2 = 0;
};

struct ProjectionMatchOptions {
  double radius_px = 10;
  int max_distance2 = 0;
  double min_ratio = 1.0;      // second nearest in the neighbourhood over nearest
  double max_scale_ratio = 2;  // of expected and found scale: beyond an octave it is another structure
  double max_view_angle_deg =
      60;  // between the directions of view: SIFT holds to about 50 degrees on a plane
  // Expected finds. SIFT matches 60 to 90 % within 5 degrees, and 60 % of that at 12, 40 % at 17, 20 % at 22,
  // 10 % at 27, 2 to 4 % at 37, measured with wide steps between images (every second or third image of a
  // bronze head, a temple and a facade). With small steps it is lower, as landmarks last observed from an
  // oblique view were mostly lost since.
  double known_again_sigma_deg = 13;
  double min_scale_px = 1, max_scale_px = 64;  // below a pixel a feature is lost in the sampling; beyond the
                                               // largest octave there is none
  CancelFlag cancelled = nullptr;              // once set, the remaining candidates are skipped
};

/// The candidate for a landmark that `feature` of a keyframe observes.
LandmarkCandidate make_candidate(LandmarkId id, const Eigen::Vector3d& x_in_map, const ImageFeatures& image,
                                 int feature, const Eigen::Vector3d& center_in_map);

/// The candidates' descriptors, one row each (N x 128, CV_8U).
cv::Mat descriptors_of(const std::vector<LandmarkCandidate>& candidates);

/// Guided matching (paper, step 4c): projects each candidate by the pose and compares it with the features
/// around its pixel. A feature that several candidates claim goes to the nearest.
std::vector<LandmarkMatch> match_by_projection(const std::vector<LandmarkCandidate>& candidates,
                                               const ImageFeatures& image, const CameraModel& camera,
                                               const Rigid3& camera_from_map,
                                               const ProjectionMatchOptions& options);

/// The landmarks that a pose should find among the candidates.
struct ExpectedFinds {
  int in_view = 0;      // those that it brings into view, at a scale at which they can be found
  double expected = 0;  // of these, weighted by the probability that SIFT matches at this viewing angle
};

/// Expected finds. A candidate counts 1 in its stored viewing direction, a half at 15 degrees from it, a
/// tenth at 28.
ExpectedFinds expected_finds(const std::vector<LandmarkCandidate>& candidates, const CameraModel& camera,
                             const Rigid3& camera_from_map, const ProjectionMatchOptions& options);

// Candidates for the landmarks that the keyframes observe: one for each landmark, with the descriptor from
// the first keyframe that observes it. excluded: landmarks that are none.
inline std::vector<LandmarkCandidate> candidates_of(const Map& map, const std::vector<KeyframeId>& keyframes,
                                                    const std::unordered_set<LandmarkId>& excluded = {}) {
  std::vector<LandmarkCandidate> candidates;
  std::unordered_set<LandmarkId> known = excluded;
  for (const KeyframeId id : keyframes) {
    const Keyframe& keyframe = *map.keyframe(id);
    const Eigen::Vector3d center = keyframe.center_in_map();
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
      const LandmarkId l = keyframe.landmark_of_feature[f];
      if (l == kNoLandmark || !known.insert(l).second) continue;
      candidates.push_back(
          make_candidate(l, map.landmark(l)->x_in_map, *keyframe.image, static_cast<int>(f), center));
    }
  }
  return candidates;
}

// Landmarks in view of the keyframe that project within radius_px of one of its features and that it does not
// observe yet. Each candidate has the descriptor of the observation nearest in viewing direction. `landmarks`
// restricts the search (nothing: all). The order is that of `landmarks`, or of the ids.
std::vector<LandmarkCandidate> unobserved_in_view(const Map& map, const Keyframe& keyframe,
                                                  const std::optional<std::vector<LandmarkId>>& landmarks,
                                                  double radius_px);

}  // namespace mono_pose_tracker
