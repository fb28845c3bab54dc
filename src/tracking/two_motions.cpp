#include "mono_pose_tracker/tracking/two_motions.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mono_pose_tracker/common/median.h"
#include "mono_pose_tracker/robust/relative_pose.h"

namespace mono_pose_tracker {

namespace {

// px at 640 px width or less. Still features are found again within 0.3 px, of noisy images within 0.5.
constexpr double kStill = 0.5;
// Up to here a feature is no object's: with a camera that moves, this ring has three times the disc's share.
constexpr double kNearlyStill = 1.0;
constexpr double kMinStillOfNearly = 0.7;
// The mean of many still features is known to hundredths; a hand-held camera shakes by tenths at least.
constexpr double kMaxMeanShift = 0.15;
constexpr int kMinStill = 40;            // features; chance leaves fewer in their place
constexpr double kMinStillShare = 0.15;  // of all matches: fewer do not disturb a map of the rest
constexpr double kMinRigid = 0.5;        // share of the moved matches; wrong matches have moved, too

double distance2(const cv::Point2f& a, const Eigen::Vector2f& b) {
  const double dx = a.x - b.x(), dy = a.y - b.y();
  return dx * dx + dy * dy;
}

double nearest2(const std::vector<cv::Point2f>& places, const Eigen::Vector2f& pixel) {
  double nearest = std::numeric_limits<double>::max();
  for (const cv::Point2f& p : places) nearest = std::min(nearest, distance2(p, pixel));
  return nearest;
}

}  // namespace

TwoMotions find_two_motions(const ImageFeatures& first, const ImageFeatures& second,
                            const std::vector<int>& second_of_first, double focal_px, int image_width,
                            const TrackerOptions& options) {
  const double size = std::max(1.0, image_width / 640.0);
  TwoMotions motions;
  std::vector<Eigen::Vector3d> bearings1, bearings2;
  std::vector<double> shift_x, shift_y, moved;
  int nearly_still = 0;
  for (std::size_t f = 0; f < second_of_first.size(); ++f) {
    if (second_of_first[f] < 0) continue;
    ++motions.matches;
    const int s = second_of_first[f];
    const Eigen::Vector2f from = first.set.features[f].pixel, to = second.set.features[s].pixel;
    const double shift = (to - from).norm();
    nearly_still += shift < kNearlyStill * size;
    if (shift < kStill * size) {
      motions.still.emplace_back(to.x(), to.y());
      shift_x.push_back(to.x() - from.x());
      shift_y.push_back(to.y() - from.y());
    } else if (shift >= options.bootstrap.min_parallax_px) {
      motions.moved_of_first.push_back(static_cast<int>(f));
      moved.push_back(shift);
      bearings1.push_back(first.set.bearings[f]);
      bearings2.push_back(second.set.bearings[s]);
    }
  }
  motions.moved_px = median(moved);
  const int still = static_cast<int>(motions.still.size());
  if (still < kMinStill || still < kMinStillShare * motions.matches ||
      still < kMinStillOfNearly * nearly_still ||
      std::hypot(median(shift_x), median(shift_y)) > kMaxMeanShift * size ||
      static_cast<int>(moved.size()) < options.bootstrap.min_landmarks) {
    return motions;
  }
  RelativePoseOptions pose_options;
  pose_options.ransac = options.ransac(focal_px);
  const RelativePoseReport pose = estimate_relative_pose(bearings1, bearings2, pose_options);
  motions.found = pose.success && pose.hypotheses[0].num_inliers >= options.bootstrap.min_landmarks &&
                  pose.hypotheses[0].num_inliers >= kMinRigid * static_cast<double>(moved.size());
  return motions;
}

std::vector<char> features_of_object(const ImageFeatures& image, const std::vector<cv::Point2f>& moved,
                                     const std::vector<cv::Point2f>& still) {
  std::vector<char> object(image.size());
  for (int i = 0; i < image.size(); ++i) {
    const Eigen::Vector2f& pixel = image.set.features[i].pixel;
    object[i] = nearest2(moved, pixel) < nearest2(still, pixel);
  }
  return object;
}

}  // namespace mono_pose_tracker
