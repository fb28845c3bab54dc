#include "mapping/reprojection_inconsistency.h"

#include <iterator>
#include <vector>

#include "common/binomial_tail.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/features/matching.h"
#include "similar_feature.h"

namespace mono_pose_tracker {

namespace {

// px at 640 px (image_scale): beyond noise, errors of the lens model and drift of a young pose.
constexpr double kElsewhere = 6;

}  // namespace

ReprojectionInconsistency reprojection_inconsistency(const Map& map, const Keyframe& first,
                                                     const Keyframe& second,
                                                     const std::vector<Match>& matches) {
  const CameraModel& camera = second.image->camera;
  const double limit_px = kElsewhere * image_scale(camera);
  ReprojectionInconsistency result;
  result.frame_index = second.frame_index;
  for (const Match& m : matches) {
    const Landmark* landmark = map.landmark(first.landmark_of_feature[m.first]);
    if (!landmark) continue;
    const Eigen::Vector3d x_in_second = second.camera_from_map * landmark->x_in_map;
    Eigen::Vector2d pixel;
    // A landmark that should be out of view was matched with a similar feature.
    if (!camera.project(x_in_second, &pixel) || !camera.in_image(pixel)) continue;
    ++result.matches;
    if (reprojection_error(*second.image, m.second, x_in_second).norm() <= limit_px) continue;
    result.contradicting +=
        !has_similar_feature_at(*second.image, first.image->set.descriptor(m.first), x_in_second, limit_px);
  }
  return result;
}

double ReprojectionInconsistency::p_value() const {
  return binomial_tail(contradicting, matches, kMostOfARightMap);
}

ReprojectionInconsistency newest_inconsistency(const Map& map, const MatchOptions& matching) {
  if (map.keyframes().size() < 2) return {};
  const auto newest = std::prev(map.keyframes().end());
  const Keyframe &first = std::prev(newest)->second, &second = newest->second;
  return reprojection_inconsistency(
      map, first, second,
      match_descriptors(first.image->set.descriptors, second.image->set.descriptors, matching));
}

}  // namespace mono_pose_tracker
