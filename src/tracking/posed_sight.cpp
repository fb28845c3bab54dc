#include "posed_sight.h"

#include <algorithm>

#include "mono_pose_tracker/camera/image_scale.h"
#include "mono_pose_tracker/features/feature_set.h"
#include "mono_pose_tracker/mapping/contradiction.h"

namespace mono_pose_tracker {

namespace {

// As of keyframes that contradict each other: px at 640 px, matches that are no chance.
constexpr double kElsewhere = 6;
constexpr int kMinMatches = 30;

WayShown shown_in(const PosedSight& first, const PosedSight& second, const MatchOptions& matching) {
  const FeatureSet& shown = first.image->set;
  const cv::Mat descriptors =
      stacked_descriptors(first.features, [&](int feature) { return shown.descriptor(feature); });
  const std::vector<Match> matches = match_descriptors(descriptors, second.image->set.descriptors, matching);
  const double limit_px = kElsewhere * image_scale(second.image->camera);
  const auto agreeing = [&](const Rigid3& camera_from_map) {
    return std::count_if(matches.begin(), matches.end(), [&](const Match& m) {
      const Eigen::Vector3d x_in_camera = camera_from_map * first.points[m.first];
      return reprojection_error(*second.image, m.second, x_in_camera).norm() <= limit_px;
    });
  };
  const auto all = static_cast<double>(matches.size());
  if (all < kMinMatches || agreeing(second.camera_from_map) < (1 - Contradiction::kMostOfARightMap) * all)
    return WayShown::kNot;
  return agreeing(first.camera_from_map) < all / 2 ? WayShown::kShown : WayShown::kAgree;
}

}  // namespace

WayShown way_shown(const PosedSight& a, const PosedSight& b, const MatchOptions& matching) {
  return std::min(shown_in(a, b, matching), shown_in(b, a, matching));
}

}  // namespace mono_pose_tracker
