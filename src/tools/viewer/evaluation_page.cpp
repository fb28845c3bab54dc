#include "evaluation_page.h"

#include <algorithm>

#include "common/text.h"
#include "io/stamp.h"

namespace mono_pose_tracker {

namespace {

using Matches = std::vector<MatchedPosition>;

Matches sorted_by_x(Matches matches) {
  std::sort(matches.begin(), matches.end(), [](const MatchedPosition& a, const MatchedPosition& b) {
    return a.estimate.x() < b.estimate.x();
  });
  return matches;
}

/// The match of a pose; its position is equal after the alignment. Null: none.
const MatchedPosition* match_of(const Matches& by_x, const Eigen::Vector3d& aligned) {
  const MatchedPosition* nearest = nullptr;
  double least = 1e-9 * (1 + aligned.norm());
  const double end = aligned.x() + least;
  auto match =
      std::lower_bound(by_x.begin(), by_x.end(), aligned.x() - least,
                       [](const MatchedPosition& candidate, double x) { return candidate.estimate.x() < x; });
  for (; match != by_x.end() && match->estimate.x() <= end; ++match) {
    const double distance = (match->estimate - aligned).norm();
    if (distance < least) least = distance, nearest = &*match;
  }
  return nearest;
}

void add_path(const EvaluatedPath& path, ScenePage* page) {
  const Sim3& s = path.error.reference_from_estimate;
  const Matches matches = sorted_by_x(path.error.positions);
  for (const StampedPose& pose : path.poses) {
    SceneImage image;
    image.name = format_stamp(pose.stamp_ns);
    image.time = static_cast<double>(pose.stamp_ns) * 1e-9;
    image.map_from_camera = Rigid3((s.rotation * pose.map_from_camera.rotation).normalized(),
                                   s * pose.map_from_camera.translation);
    const MatchedPosition* const match = match_of(matches, image.map_from_camera->translation);
    if (match) {
      image.error = (match->estimate - match->reference).norm();
      image.notes.push_back(formatted("rotation is off by %.2f degrees", match->rotation_deg));
      page->worst_error = std::max(page->worst_error, *image.error);
    } else {
      image.notes.push_back("no reference pose near in time");
    }
    page->images.push_back(std::move(image));
  }
}

}  // namespace

ScenePage evaluation_page(const std::vector<StampedPose>& reference,
                          const std::vector<EvaluatedPath>& paths) {
  ScenePage page;
  page.unit = "reference units";
  page.worst_error = 1e-12;  // coloured by error also where there is none
  std::size_t matched = 0;
  for (const EvaluatedPath& path : paths) {
    // The images of another map follow a gap.
    if (!page.images.empty()) {
      SceneImage gap;
      gap.name = "another map begins";
      gap.state = SceneImage::State::kNotRegistered;
      page.images.push_back(gap);
    }
    add_path(path, &page);
    matched += static_cast<std::size_t>(path.error.frames_matched);
  }
  if (!paths.empty()) {
    page.up = -(paths.front().error.reference_from_view.rotation * Eigen::Vector3d::UnitY());
    page.title = formatted("%zu poses compared: position RMSE %.4g, median %.4g, max %.4g", matched,
                           paths.front().error.position_rmse, paths.front().error.position_median,
                           paths.front().error.position_max);
  }
  for (const StampedPose& pose : reference) page.reference.push_back(pose.map_from_camera.translation);
  return page;
}

}  // namespace mono_pose_tracker
