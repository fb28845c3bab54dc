#include "body_follower.h"

#include <algorithm>
#include <utility>

#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/tracking/two_motions.h"

namespace mono_pose_tracker {

bool BodyFollower::follow(const CameraModel& camera, const TrackerOptions& options, Frame* frame) {
  const ImageFeaturesPtr image = frame->image;
  std::vector<cv::Point2f> turning, otherwise;
  known_.assign(image->size(), Side::kUnknown);
  for (const Match& m :
       match_descriptors(last_.image->set.descriptors, image->set.descriptors, options.matching)) {
    const Eigen::Vector2f& pixel = image->set.features[m.second].pixel;
    if (last_.turns[m.first]) {
      turning.emplace_back(pixel.x(), pixel.y());
      known_[m.second] = Side::kTurns;
    } else if (last_.moves_otherwise[m.first]) {
      otherwise.emplace_back(pixel.x(), pixel.y());
      known_[m.second] = Side::kMovesOtherwise;
    }
  }
  otherwise_ = std::move(otherwise);
  if (turning.size() < kFewest) return false;
  divide(image, turning);
  *frame = of_body(camera, *frame);
  return true;
}

Frame BodyFollower::of_body(const CameraModel& camera, const Frame& frame) const {
  Frame masked = frame;
  masked.whole = frame.image;
  masked.image = select_features(*frame.image, last_.turns, camera.width(), camera.height());
  masked.is_masked = true;
  return masked;
}

Frame BodyFollower::settle(const CameraModel& camera, const Frame& frame,
                           const std::vector<cv::Point2f>& inliers) {
  divide(frame.image, inliers);
  return of_body(camera, frame);
}

void BodyFollower::settle(const std::vector<cv::Point2f>& inliers) {
  if (inliers.size() >= kFewest) divide(last_.image, inliers);
}

void BodyFollower::divide(ImageFeaturesPtr image, const std::vector<cv::Point2f>& turning) {
  last_.turns = features_of_object(*image, turning, otherwise_);
  for (int f = 0; f < image->size(); ++f) {
    const Eigen::Vector2f& pixel = image->set.features[f].pixel;
    // What the body was posed by is not of something else, whatever it was taken for.
    if (std::find(turning.begin(), turning.end(), cv::Point2f(pixel.x(), pixel.y())) != turning.end()) {
      last_.turns[f] = 1;
    } else if (known_[f] != Side::kUnknown) {
      last_.turns[f] = known_[f] == Side::kTurns;
    }
  }
  last_.moves_otherwise.clear();
  for (const char turns : last_.turns) last_.moves_otherwise.push_back(turns == 0);
  last_.image = std::move(image);
}

}  // namespace mono_pose_tracker
