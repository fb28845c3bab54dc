#include "posed_sight.h"

#include "mono_pose_tracker/camera/image_scale.h"
#include "mono_pose_tracker/features/feature_set.h"

namespace mono_pose_tracker {

namespace {

// As of keyframes that contradict each other (mapping/contradiction.h): px at 640 px, matches that are no
// chance, and the share of them that lies elsewhere in a right map at most.
constexpr double kElsewhere = 6;
constexpr int kMinMatches = 30;
constexpr double kMostElsewhere = 1.0 / 10;

bool is_found_in(const PosedSight& first, const PosedSight& second, const MatchOptions& matching) {
  const FeatureSet& shown = first.image->set;
  const cv::Mat descriptors =
      stacked_descriptors(first.features, [&](int feature) { return shown.descriptor(feature); });
  const std::vector<Match> matches = match_descriptors(descriptors, second.image->set.descriptors, matching);
  const double limit_px = kElsewhere * image_scale(second.image->camera);
  int there = 0;
  for (const Match& m : matches) {
    const Eigen::Vector3d x_in_second = second.camera_from_map * first.points[m.first];
    there += reprojection_error(*second.image, m.second, x_in_second).norm() <= limit_px;
  }
  const auto all = static_cast<double>(matches.size());
  return all >= kMinMatches && there >= (1 - kMostElsewhere) * all;
}

}  // namespace

bool show_the_way(const PosedSight& a, const PosedSight& b, const MatchOptions& matching) {
  return is_found_in(a, b, matching) && is_found_in(b, a, matching);
}

}  // namespace mono_pose_tracker
