#pragma once

#include <optional>
#include <string>
#include <vector>

#include "map/frame.h"
#include "map/tracking_map.h"
#include "mapping/pose_support.h"
#include "mapping/projection_matcher.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/status.h"
#include "mono_pose_tracker/tracking/frame_report.h"
#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

struct RegistrationReport {
  bool success = false;
  Reason reason = Reason::kTooFewMatches;
  std::string text;
  bool is_where_predicted = false;  // the prediction led to it
  Rigid3 camera_from_map;
  Matrix6d covariance = Matrix6d::Zero();  // of map_from_camera, as FrameReport::covariance; the map is held
  Matrix6d map_covariance = Matrix6d::Zero();  // what the map's own uncertainty adds; images near share it
  int matches = 0;
  int inliers = 0;
  PoseSupport support;
  double rms_px = 0;
  std::vector<int> matched;                    // features that were matched, inliers or not
  std::vector<FrameObservation> observations;  // the inliers
};

/// A success beats a failure, then more inliers fewer; of equals, a.
bool is_better(const RegistrationReport& a, const RegistrationReport& b);

/// Poses a frame against the map (paper, steps 4a and 4b): putative matches to landmarks, P3P RANSAC, guided
/// matching round the pose found, robust motion-only refinement. Keeps no state between frames.
class FrameRegistrar {
 public:
  FrameRegistrar(const TrackerOptions& options, const CameraModel& camera)
      : options_(options), camera_(camera) {}

  /// Against the landmarks of the reference keyframe and those that share view with it. The prediction only
  /// guides the matching; where there is none or it fails, descriptors alone decide.
  RegistrationReport register_frame(const Frame& frame, const TrackingMap& map, KeyframeId reference,
                                    const std::optional<Rigid3>& predicted_camera_from_map) const;

  /// Against keyframes anywhere in the map, by descriptors alone: the `budget` that look like it most. A
  /// success is supported (pose_support.h) and has no rival; a second view should agree before anything is
  /// made of it.
  RegistrationReport relocalize(const Frame& frame, const TrackingMap& map, int budget) const;

  /// Which of these landmarks the frame shows where the pose has them.
  std::vector<FrameObservation> observations_at(const Frame& frame, const TrackingMap& map,
                                                KeyframeId reference, const Rigid3& camera_from_map) const;

 private:
  std::vector<LandmarkCandidate> local_candidates(const TrackingMap& map, KeyframeId reference) const;
  std::vector<LandmarkCandidate> candidates_of(const TrackingMap& map,
                                               const std::vector<KeyframeId>& keyframes) const;
  ProjectionMatchOptions near_a_pose() const;
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
