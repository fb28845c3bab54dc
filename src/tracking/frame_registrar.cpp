#include "tracking/frame_registrar.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>

#include "common/rotation.h"
#include "common/text.h"
#include "mapping/landmark_pose.h"
#include "mono_pose_tracker/robust/absolute_pose.h"

namespace mono_pose_tracker {

namespace {

constexpr FrameRegistrarOptions kRegistrar{};

std::string shortfall(int found, int needed, const char* what) {
  return formatted("%d %s, %d needed", found, what, needed);
}

std::string unsupported(const PoseSupport& support) {
  return formatted("%d points found where %.0f are expected, over %.0f %% of the area with visible landmarks",
                   support.found, support.in_map.expected, 100 * support.spread);
}

// The keyframes most similar to the frame. Keyframes of the index that are gone from the snapshot are
// skipped.
std::vector<KeyframeId> places_of(const Frame& frame, const TrackingMap& map, int budget) {
  std::vector<KeyframeId> places;
  if (!map.places) return places;
  for (const KeyframeId id : map.places->find(frame.image->set, budget)) {
    if (map.keyframes.count(id)) places.push_back(id);
  }
  return places;
}

Matrix6d covariance_of_map_from_camera(const Matrix6d& of_camera_from_map, const Rigid3& camera_from_map) {
  Matrix6d rotation = Matrix6d::Zero();
  rotation.topLeftCorner<3, 3>() = camera_from_map.rotation_matrix().transpose();
  rotation.bottomRightCorner<3, 3>() = rotation.topLeftCorner<3, 3>();
  return rotation * of_camera_from_map * rotation.transpose();
}

// Adds the uncertainty of the reference keyframe in the map. All its points share it, so it is independent of
// the frame's own matches.
void add_uncertainty_of_map(const TrackingMap& map, KeyframeId reference, RegistrationReport* report) {
  const auto keyframe = map.keyframes.find(reference);
  const auto known = map.covariances.find(reference);
  if (!report->success || keyframe == map.keyframes.end() || known == map.covariances.end()) return;
  const Matrix6d carried = adjoint(report->camera_from_map * keyframe->second.camera_from_map.inverse());
  report->map_covariance = covariance_of_map_from_camera(
      kRegistrar.error_correlation * carried * known->second * carried.transpose(), report->camera_from_map);
}

// Registration of a frame by the descriptors of one keyframe.
struct FoundPlace {
  KeyframeId keyframe;
  RegistrationReport report;
};

// Median distance in the image between the landmarks of one registration under its own pose and under the
// other.
double offset_px(const TrackingMap& map, const CameraModel& camera, const RegistrationReport& found,
                 const Rigid3& camera_from_map) {
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> x_in_camera;
  for (const FrameObservation& o : found.observations) {
    const auto landmark = map.landmarks.find(o.landmark);
    if (landmark == map.landmarks.end()) continue;
    x_in_camera.emplace_back(found.camera_from_map * landmark->second, camera_from_map * landmark->second);
  }
  return disagreement_px(camera, x_in_camera);
}

bool may_be_drift(const TrackingMap& map, const FoundPlace& a, const FoundPlace& b) {
  const Rigid3 a_in_map = a.report.camera_from_map.inverse(), b_in_map = b.report.camera_from_map.inverse();
  if (a_in_map.rotation.angularDistance(b_in_map.rotation) > kRegistrar.places.max_rotation_drift)
    return false;
  return (a_in_map.translation - b_in_map.translation).norm() <=
         kRegistrar.places.max_drift *
             path_length_between(map.keyframes, map.keyframes.at(a.keyframe), map.keyframes.at(b.keyframe));
}

// Whether the best place is ambiguous: another place explains the frame nearly as well with a different pose,
// such as another door of a row. The frame cannot decide between them. Duplicated structure due to drift
// counts as one place.
bool has_alias(const TrackingMap& map, const CameraModel& camera, const std::vector<FoundPlace>& places,
               const FoundPlace& best) {
  return std::any_of(places.begin(), places.end(), [&](const FoundPlace& other) {
    return other.report.success &&
           other.report.support.found > kRegistrar.places.aliased_share * best.report.support.found &&
           offset_px(map, camera, other.report, best.report.camera_from_map) >
               kRegistrar.places.elsewhere_px * image_scale(camera) &&
           !may_be_drift(map, best, other);
  });
}

}  // namespace

bool is_better(const RegistrationReport& a, const RegistrationReport& b) {
  return std::make_pair(a.success, a.inliers) >= std::make_pair(b.success, b.inliers);
}

std::vector<LandmarkCandidate> FrameRegistrar::local_candidates(const TrackingMap& map,
                                                                KeyframeId reference) const {
  const auto found = map.keyframes.find(reference);
  if (found == map.keyframes.end()) return {};
  std::vector<KeyframeId> local = {reference};
  for (const KeyframeId id : found->second.covisible) {
    if (static_cast<int>(local.size()) >= options_.resection.max_local_keyframes) break;
    local.push_back(id);
  }
  return candidates_of(map, local);
}

std::vector<LandmarkCandidate> FrameRegistrar::candidates_of(const TrackingMap& map,
                                                             const std::vector<KeyframeId>& keyframes) const {
  std::vector<LandmarkCandidate> candidates;
  std::unordered_set<LandmarkId> known;
  for (const KeyframeId id : keyframes) {
    const KeyframeView& keyframe = map.keyframes.at(id);
    const Eigen::Vector3d center = keyframe.camera_from_map.inverse().translation;
    for (std::size_t f = 0; f < keyframe.landmark_of_feature.size(); ++f) {
      const LandmarkId l = keyframe.landmark_of_feature[f];
      if (l == kNoLandmark || !known.insert(l).second) continue;
      const auto landmark = map.landmarks.find(l);
      if (landmark == map.landmarks.end()) continue;
      candidates.push_back(make_candidate(l, landmark->second, *keyframe.image, static_cast<int>(f), center));
    }
  }
  return candidates;
}

RegistrationReport FrameRegistrar::pose_from_matches(const Frame& frame,
                                                     const std::vector<LandmarkCandidate>& candidates,
                                                     const std::vector<LandmarkMatch>& matches) const {
  RegistrationReport report;
  report.matches = static_cast<int>(matches.size());
  for (const LandmarkMatch& m : matches) report.matched.push_back(m.feature);
  if (report.matches < options_.resection.min_inliers) {
    report.fail(Reason::kTooFewMatches,
                shortfall(report.matches, options_.resection.min_inliers, "matches to landmarks"));
    return report;
  }
  const LandmarkObservations visible = observations_by(*frame.image, candidates, matches);
  AbsolutePoseOptions pose_options = AbsolutePoseOptions::in_growing_map(options_.ransac(camera_.focal()));
  pose_options.ransac.seed += static_cast<std::uint64_t>(frame.index);
  for (const LandmarkMatch& m : matches) pose_options.quality.push_back(static_cast<float>(m.distance2));
  const AbsolutePoseReport pose = estimate_absolute_pose(visible.bearings, visible.points, pose_options);
  report.inliers = pose.num_inliers;
  const int needed = std::max(options_.resection.min_inliers,
                              static_cast<int>(options_.resection.min_inlier_ratio * report.matches));
  if (!pose.success || pose.num_inliers < needed) {
    report.fail(Reason::kTooFewInliers, shortfall(pose.num_inliers, needed, "inliers"));
    return report;
  }
  report.success = true;
  report.reason = Reason::kOk;
  report.camera_from_map = pose.camera_from_map;
  return report;
}

ProjectionMatchOptions FrameRegistrar::within(double radius_px) const {
  ProjectionMatchOptions guided;
  guided.radius_px = radius_px;
  guided.max_distance2 = stored_distance2(options_.mapping.max_descriptor_distance);
  guided.cancelled = options_.cancelled;
  return guided;
}

void FrameRegistrar::refine(const Frame& frame, const std::vector<LandmarkCandidate>& candidates,
                            RegistrationReport* report) const {
  const GuidedPose pose =
      refine_by_guided_matching(candidates, *frame.image, report->camera_from_map,
                                within(options_.resection.refine_radius_px * image_scale(camera_)));
  if (pose.converged) {
    report->camera_from_map = pose.camera_from_map;
    report->covariance = covariance_of_map_from_camera(pose.covariance, pose.camera_from_map);
  }
  const std::vector<LandmarkMatch> inliers = inliers_of(
      *frame.image, candidates, pose.matches, report->camera_from_map, options_.inlier_threshold_px);
  report->matches = static_cast<int>(pose.matches.size());
  report->matched.clear();
  for (const LandmarkMatch& m : pose.matches) report->matched.push_back(m.feature);
  report->inliers = static_cast<int>(inliers.size());
  double sum = 0;
  for (const LandmarkMatch& m : inliers) {
    const Eigen::Vector3d x_in_camera = report->camera_from_map * candidates[m.candidate].x_in_map;
    sum += reprojection_error(*frame.image, m.feature, x_in_camera).squaredNorm();
    report->observations.push_back({m.feature, candidates[m.candidate].id});
  }
  if (!pose.converged)
    return report->fail(Reason::kTooFewInliers, "the refinement of the pose did not converge");
  if (report->inliers < options_.resection.min_inliers) {
    return report->fail(Reason::kTooFewInliers, shortfall(report->inliers, options_.resection.min_inliers,
                                                          "inliers after refinement"));
  }
  report->rms_px = std::sqrt(sum / inliers.size());
  std::vector<int> features;
  for (const LandmarkMatch& m : inliers) features.push_back(m.feature);
  report->support =
      pose_support(*frame.image, features, expected_finds(candidates, camera_, report->camera_from_map, {}));
}

RegistrationReport FrameRegistrar::by_prediction(const Frame& frame,
                                                 const std::vector<LandmarkCandidate>& candidates,
                                                 const Rigid3& predicted) const {
  ProjectionMatchOptions guided = within(options_.resection.search_radius * longer_side(camera_));
  guided.min_ratio = kRegistrar.ratio_where_expected;
  return pose_from_matches(frame, candidates,
                           match_by_projection(candidates, *frame.image, predicted, guided));
}

RegistrationReport FrameRegistrar::by_descriptors(const Frame& frame,
                                                  const std::vector<LandmarkCandidate>& candidates) const {
  return pose_from_matches(frame, candidates,
                           match_by_descriptors(candidates, *frame.image, options_.matching));
}

RegistrationReport FrameRegistrar::register_frame(const Frame& frame, const TrackingMap& map,
                                                  KeyframeId reference,
                                                  const std::optional<Rigid3>& predicted) const {
  const std::vector<LandmarkCandidate> candidates = local_candidates(map, reference);
  RegistrationReport report;
  if (predicted) {
    report = by_prediction(frame, candidates, *predicted);
    if (report.success) refine(frame, candidates, &report);
    report.is_where_predicted = report.success;
  }
  if (!report.success) {
    report = by_descriptors(frame, candidates);
    if (report.success) refine(frame, candidates, &report);
  }
  add_uncertainty_of_map(map, reference, &report);
  return report;
}

// Uses only the keyframe's own landmarks to recognise the place; its neighbours' would take ten times as
// long.
RegistrationReport FrameRegistrar::look_at_place(const Frame& frame, const TrackingMap& map,
                                                 KeyframeId id) const {
  RegistrationReport report = by_descriptors(frame, candidates_of(map, {id}));
  if (report.success) refine(frame, local_candidates(map, id), &report);
  add_uncertainty_of_map(map, id, &report);
  if (report.success && !is_supported(report.support, options_.resection.min_inliers))
    report.fail(Reason::kTooFewInliers, unsupported(report.support));
  return report;
}

RegistrationReport FrameRegistrar::relocalize(const Frame& frame, const TrackingMap& map, int budget) const {
  std::vector<FoundPlace> places;
  for (const KeyframeId id : places_of(frame, map, budget)) {
    if (is_set(options_.cancelled)) break;
    places.push_back({id, look_at_place(frame, map, id)});
  }
  const FoundPlace* best = nullptr;
  for (const FoundPlace& place : places) {
    if (!best || is_better(place.report, best->report)) best = &place;
  }
  RegistrationReport report;
  report.text = "no keyframe is similar to the image";
  if (best) report = best->report;
  if (report.success && has_alias(map, camera_, places, *best))
    report.fail(Reason::kAmbiguousPose, "two poses in the map fit the image equally well");
  return report;
}

}  // namespace mono_pose_tracker
