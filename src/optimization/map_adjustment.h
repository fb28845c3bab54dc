#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "common/statistics.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/optimization/bundle_adjustment.h"

namespace mono_pose_tracker {

// `loss_width` times the spread of the residuals, given by their norms in sigmas; unchanged without
// residuals.
inline double loss_width_by_spread(double loss_width, std::vector<double> lengths) {
  if (lengths.empty()) return loss_width;
  // Below a tenth of a pixel it is the features' own quantisation that speaks; above one, outliers.
  return loss_width * std::clamp(sigma_of_lengths(std::move(lengths)), 0.1, 1.0);
}

// Keyframes that observe the landmarks but are not free: those with the most observations, sorted.
std::vector<KeyframeId> fixed_keyframes(const Map& map, const std::vector<LandmarkId>& landmarks,
                                        const std::vector<KeyframeId>& free, int max_fixed);

// For each keyframe, at least two of its landmarks with the most observations: they connect the most views at
// the lowest cost. Sorted.
std::vector<LandmarkId> most_observed_landmarks(const Map& map, const std::vector<KeyframeId>& keyframes,
                                                int max_of_keyframe);

/// Feature `feature` of an image as an observation of point `point` by camera `camera`.
BundleObservation make_observation(int camera, int point, const ImageFeatures& image, int feature);

/// Landmarks in adjust_keyframes.
struct LandmarkSelection {
  int point_iterations = 5;  // of a single point: two or three are enough after a small motion of its cameras
  int least_landmarks = 50;  // that determine the pose of a keyframe; the work is not reduced below
  int cells_across = 8, cells_down = 6;  // grid of an image, to distribute the landmarks that constrain its
                                         // pose: a few fall into each cell
};

/// Bundle adjustment of the given keyframes and all their landmarks. At most max_fixed other keyframes that
/// observe these landmarks stay fixed and define the gauge (those with the most observations). The cameras
/// are adjusted with max_landmarks of each free keyframe, those with the most observations, distributed over
/// its image: they constrain the poses best and converge fastest. The other landmarks, and those with one
/// observation in the problem, are adjusted afterwards with the cameras fixed. Not usable: the map is
/// unchanged. The loss width is options.loss_width times the spread of the residuals (median), so that sharp
/// images get a narrower loss than blurred ones.
BundleReport adjust_keyframes(const BundleOptions& options, const std::vector<KeyframeId>& free_keyframes,
                              int max_fixed, int max_landmarks, Map* map,
                              const LandmarkSelection& selection = {});

/// The options with ten times the loss width, for parts of a map that have just been connected: they are as
/// far apart as they have drifted, and a loss meant for noise would hardly pull them together. Adjust again
/// with the original options afterwards.
BundleOptions with_wide_loss(BundleOptions options);

/// Bundle adjustment of the whole map. The oldest keyframe stays fixed, and one coordinate of the farthest
/// fixes the scale.
BundleReport adjust_map(const BundleOptions& options, Map* map);

struct CovarianceOptions {
  // Information on the gauge relative to that on a coordinate. The uncertainty (variance) added by the gauge
  // is about 0.1 % of that of the coordinates, and the decomposition loses three of its sixteen digits.
  double gauge_weight = 1e3;
  double loss_width = 2;  // sigmas: a larger residual is more likely an outlier than noise
};

/// Covariance of the pose of each of these keyframes after the adjustment: of the motion x' = exp(w) x + v in
/// the camera's frame (order v, w; map units and radians), marginal over points and the other keyframes
/// (Triggs et al. 1999, section 9). The noise is estimated from the residuals.
///
/// Other keyframes with the same points are held fixed, at most max_fixed of them; their own uncertainty is
/// not included. With fewer than two of them nothing is fixed, and the covariance is relative to the
/// keyframes' own centroid, orientation and size: errors that a common similarity would undo do not count.
///
/// At most max_landmarks of each keyframe are used, those with the most observations. Empty unless there are
/// more residuals than unknowns.
std::map<KeyframeId, Eigen::Matrix<double, 6, 6>> keyframe_covariances(
    const std::vector<KeyframeId>& keyframes, int max_fixed, int max_landmarks, const Map& map,
    const CovarianceOptions& options = {});

}  // namespace mono_pose_tracker
