#include "tracking/two_motions.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/statistics.h"
#include "geometry/essential.h"
#include "mapping/static_background.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/robust/relative_pose.h"

namespace mono_pose_tracker {

namespace {

constexpr TwoMotionsOptions kTwoMotions{};

double distance2(const cv::Point2f& a, const Eigen::Vector2f& b) {
  const double dx = a.x - b.x(), dy = a.y - b.y();
  return dx * dx + dy * dy;
}

double nearest2(const std::vector<cv::Point2f>& places, const Eigen::Vector2f& pixel) {
  double nearest = std::numeric_limits<double>::max();
  for (const cv::Point2f& p : places) nearest = std::min(nearest, distance2(p, pixel));
  return nearest;
}

// Shifts of a share of the matches.
struct Shifts {
  std::vector<double> x, y;  // of matches nearer than `still`
  int nearly = 0;            // number of matches nearer than `nearly_still`
};

Shifts shifts_of(const std::vector<Eigen::Vector2f>& shifts, double still, double nearly_still) {
  Shifts s;
  for (const Eigen::Vector2f& shift : shifts) {
    const double length = shift.norm();
    s.nearly += length < nearly_still;
    if (length >= still) continue;
    s.x.push_back(shift.x());
    s.y.push_back(shift.y());
  }
  return s;
}

// Many features that are static within the noise.
bool are_many_still(const std::vector<Eigen::Vector2f>& shifts, double size) {
  const Shifts s = shifts_of(shifts, kTwoMotions.still_px * size, kTwoMotions.nearly_still_px * size);
  const auto still = static_cast<double>(s.x.size());
  return still >= kTwoMotions.min_still &&
         still >= kTwoMotions.min_still_share * static_cast<double>(shifts.size()) &&
         still >= kTwoMotions.min_still_of_nearly * s.nearly &&
         std::hypot(median(s.x), median(s.y)) <= kTwoMotions.max_mean_shift_px * size;
}

// A few nearly static features while the others are far away.
bool are_few_still(const std::vector<Eigen::Vector2f>& shifts, double moved_px, double size) {
  const Shifts s = shifts_of(shifts, kTwoMotions.few_still_px * size, kTwoMotions.nearly_few_still_px * size);
  const auto still = static_cast<double>(s.x.size());
  return moved_px >= kTwoMotions.min_few_moved_px * size && still >= kTwoMotions.min_few_still &&
         still >= kTwoMotions.min_few_still_share * static_cast<double>(shifts.size()) &&
         still >= kTwoMotions.min_few_of_nearly * s.nearly &&
         std::hypot(median(s.x), median(s.y)) <= kTwoMotions.max_few_mean_shift_px * size;
}

// Present pixels of the features that obey the motion, however small.
std::vector<cv::Point2f> moved_as(const ImageFeatures& first, const ImageFeatures& second,
                                  const std::vector<int>& second_of_first, const Rigid3& second_from_first,
                                  double least_px, double threshold) {
  const Eigen::Matrix3d essential = essential_matrix(second_from_first);
  std::vector<cv::Point2f> pixels;
  for (std::size_t f = 0; f < second_of_first.size(); ++f) {
    const int s = second_of_first[f];
    if (s < 0) continue;
    const Eigen::Vector2f& to = second.set.features[s].pixel;
    if ((to - first.set.features[f].pixel).norm() < least_px) continue;
    const double error = sampson_error(essential, first.set.bearings[f], second.set.bearings[s]);
    if (std::abs(error) < threshold) pixels.emplace_back(to.x(), to.y());
  }
  return pixels;
}

}  // namespace

TwoMotions find_two_motions(const ImageFeatures& first, const ImageFeatures& second,
                            const std::vector<int>& second_of_first, const std::vector<char>& has_moved,
                            const CameraModel& camera, const TrackerOptions& options) {
  const double size = image_scale(camera);
  TwoMotions motions;
  std::vector<Eigen::Vector3d> bearings1, bearings2;
  std::vector<Eigen::Vector2f> shifts;
  std::vector<double> moved;
  for (std::size_t f = 0; f < second_of_first.size(); ++f) {
    if (second_of_first[f] < 0) continue;
    ++motions.matches;
    const int s = second_of_first[f];
    const Eigen::Vector2f to = second.set.features[s].pixel;
    const Eigen::Vector2f shift = to - first.set.features[f].pixel;
    const double length = shift.norm();
    // A feature that returned to its place was not static.
    const bool came_back =
        !has_moved.empty() && has_moved[f] && length < kTwoMotions.nearly_few_still_px * size;
    if (!came_back) shifts.push_back(shift);
    if (length < kTwoMotions.few_still_px * size) {
      if (came_back) continue;
      motions.still.emplace_back(to.x(), to.y());
      motions.still_of_first.push_back(static_cast<int>(f));
    } else if (length >= options.bootstrap.min_parallax_px) {
      motions.moved_of_first.push_back(static_cast<int>(f));
      moved.push_back(length);
      bearings1.push_back(first.set.bearings[f]);
      bearings2.push_back(second.set.bearings[s]);
    }
  }
  motions.moved_px = median(moved);
  if (static_cast<int>(moved.size()) < options.bootstrap.min_landmarks ||
      !(are_many_still(shifts, size) || are_few_still(shifts, motions.moved_px, size))) {
    return motions;
  }
  RelativePoseOptions pose_options;
  pose_options.ransac = options.ransac(camera.focal());
  pose_options.without_accidental_matches = false;  // another object's matches are localised
  const RelativePoseReport pose = estimate_relative_pose(bearings1, bearings2, pose_options);
  motions.found = pose.success && pose.hypotheses[0].num_inliers >= options.bootstrap.min_landmarks &&
                  pose.hypotheses[0].num_inliers >= kTwoMotions.min_rigid * static_cast<double>(moved.size());
  if (!motions.found || options.segmentation.wants_turning_object()) return motions;
  const std::vector<cv::Point2f> rigid =
      moved_as(first, second, second_of_first, pose.hypotheses[0].second_from_first,
               kTwoMotions.few_still_px * size, pose_options.ransac.threshold);
  motions.is_ego_vehicle = reaches_round(rigid, motions.still, camera);
  motions.found = !motions.is_ego_vehicle;
  return motions;
}

std::vector<char> features_of_object(const ImageFeatures& image, const std::vector<cv::Point2f>& moved,
                                     const std::vector<cv::Point2f>& still, CancelFlag cancelled) {
  std::vector<char> object(image.size());
  for (int i = 0; i < image.size() && !is_set(cancelled); ++i) {
    const Eigen::Vector2f& pixel = image.set.features[i].pixel;
    object[i] = nearest2(moved, pixel) < nearest2(still, pixel);
  }
  return object;
}

}  // namespace mono_pose_tracker
