#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "map/frame.h"
#include "map/tracking_map.h"
#include "mapping/aliased_places.h"
#include "mapping/projection_matcher.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/status.h"
#include "mono_pose_tracker/tracking/frame_report.h"
#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

/// Thresholds of the FrameRegistrar in addition to the user's TrackerOptions.
struct FrameRegistrarOptions {
  /// Minimum ratio of second nearest to nearest distance for a predicted point: within a few per cent of the
  /// image, similar features are rarer than in the whole image, for which the paper has 1.25.
  double ratio_where_expected = 1.1;
  /// Errors of one point in near views are correlated (the same texture), as if each had an eighth of an
  /// independent one's information. Measured with ground truth on simulated rooms and heads
  /// (test/tracking/pose_covariance_test.cpp).
  double error_correlation = 8;
  AliasedPlaceOptions places;
};

struct RegistrationReport {
  bool success = false;
  Reason reason = Reason::kTooFewMatches;
  std::string text;
  bool is_where_predicted = false;  // found from the prediction
  Rigid3 camera_from_map;
  Matrix6d covariance = Matrix6d::Zero();  // of map_from_camera, as FrameReport::covariance; for a fixed map
  Matrix6d map_covariance =
      Matrix6d::Zero();  // additional covariance from the map's uncertainty; shared by near images
  int matches = 0;
  int inliers = 0;
  PoseSupport support;
  double rms_px = 0;
  std::vector<int> matched;                    // matched features, inliers or not
  std::vector<FrameObservation> observations;  // the inliers

  void fail(Reason why, std::string how) { success = false, reason = why, text = std::move(how); }
};

/// Whether a is better than b: a success is better than a failure, then more inliers are better. Of equals,
/// a.
bool is_better(const RegistrationReport& a, const RegistrationReport& b);

/// Registers a frame in the map (paper, steps 4a and 4b): putative matches with landmarks, P3P RANSAC, guided
/// matching around the pose, robust motion-only refinement. Keeps no state between frames.
class FrameRegistrar {
 public:
  FrameRegistrar(const TrackerOptions& options, const CameraModel& camera)
      : options_(options), camera_(camera) {}

  /// Registers against the landmarks of the reference keyframe and its covisible keyframes. The prediction
  /// only guides the matching; where there is none or it fails, descriptors alone decide.
  RegistrationReport register_frame(const Frame& frame, const TrackingMap& map, KeyframeId reference,
                                    const std::optional<Rigid3>& predicted_camera_from_map) const;

  /// Registers against keyframes anywhere in the map, by descriptors alone: the `budget` most similar ones. A
  /// success is supported (is_supported) and not ambiguous; callers should require a second consistent
  /// view.
  RegistrationReport relocalize(const Frame& frame, const TrackingMap& map, int budget) const;

 private:
  std::vector<LandmarkCandidate> local_candidates(const TrackingMap& map, KeyframeId reference) const;
  std::vector<LandmarkCandidate> candidates_of(const TrackingMap& map,
                                               const std::vector<KeyframeId>& keyframes) const;
  ProjectionMatchOptions within(double radius_px) const;
  RegistrationReport by_prediction(const Frame& frame, const std::vector<LandmarkCandidate>& candidates,
                                   const Rigid3& predicted) const;
  RegistrationReport by_descriptors(const Frame& frame,
                                    const std::vector<LandmarkCandidate>& candidates) const;
  RegistrationReport pose_from_matches(const Frame& frame, const std::vector<LandmarkCandidate>& candidates,
                                       const std::vector<LandmarkMatch>& matches) const;
  RegistrationReport look_at_place(const Frame& frame, const TrackingMap& map, KeyframeId id) const;
  void refine(const Frame& frame, const std::vector<LandmarkCandidate>& candidates,
              RegistrationReport* report) const;

  TrackerOptions options_;
  CameraModel camera_;
};

}  // namespace mono_pose_tracker
