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
                                               const ImageFeatures& image, const Rigid3& camera_from_map,
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

/// When a pose has enough support. Shares are in [0, 1].
struct PoseSupportOptions {
  double min_found = 0.2;  // share of the expected landmarks
  // From the first share of the landmarks in view on, any viewpoint is possible. Below it, no more than the
  // second number times the expectation may be found.
  double min_found_from_near = 0.15, max_oblique_excess = 2;
  int few_features = 150;    // of the image: with fewer, missing landmarks are no evidence
  double min_spread = 0.25;  // share of the cells with features
  double corner = 0.125;     // the same, below which the inliers may be of a small object
};

/// Evidence for a pose that was not predicted: expected landmarks that were found, and their distribution
/// over the image.
struct PoseSupport {
  int found = 0;  // inliers
  ExpectedFinds in_map;
  double spread = 0;  // share of the cells with features that hold inliers
  int features = 0;   // of the image
};

/// inliers: features of the image that agree with the pose. The image is divided into 8 x 6 cells.
PoseSupport pose_support(const ImageFeatures& image, const std::vector<int>& inliers,
                         const ExpectedFinds& in_map);

/// Whether the pose has enough support to be accepted once a second view agrees. SIFT finds two of three
/// expected landmarks, one of four in a blurred image. At an aliased place (one window of many, one door of a
/// row) the surroundings are not found: one of seven is usual, one of five rare, and the finds lie in one
/// corner. The expectation is limited to the number of features in the image, but is at least thirty. A pose
/// is aliased where fewer landmarks are expected than a pose needs, as from behind. It is also aliased where
/// the expectation is below 15 % of the landmarks in view, as at oblique views, and more than twice as many
/// are found.
bool is_supported(const PoseSupport& support, int min_inliers);

/// Whether the inliers lie in less than an eighth of the cells with features. The pose may then depend on a
/// small independently moving object.
bool is_confined_to_corner(const PoseSupport& support);

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
