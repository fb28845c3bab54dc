#include "aliased_place.h"

#include <algorithm>
#include <utility>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

namespace {

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

bool may_be_drift(const TrackingMap& map, const FoundPlace& a, const FoundPlace& b,
                  const AliasedPlaceOptions& options) {
  const Rigid3 a_in_map = a.report.camera_from_map.inverse(), b_in_map = b.report.camera_from_map.inverse();
  if (a_in_map.rotation.angularDistance(b_in_map.rotation) > options.max_rotation_drift) return false;
  return (a_in_map.translation - b_in_map.translation).norm() <=
         options.max_drift *
             path_length_between(map.keyframes, map.keyframes.at(a.keyframe), map.keyframes.at(b.keyframe));
}

}  // namespace

bool has_alias(const TrackingMap& map, const CameraModel& camera, const std::vector<FoundPlace>& places,
               const FoundPlace& best, const AliasedPlaceOptions& options) {
  return std::any_of(places.begin(), places.end(), [&](const FoundPlace& other) {
    return other.report.success &&
           other.report.support.found > options.aliased_share * best.report.support.found &&
           offset_px(map, camera, other.report, best.report.camera_from_map) >
               options.elsewhere_px * image_scale(camera) &&
           !may_be_drift(map, best, other, options);
  });
}

}  // namespace mono_pose_tracker
