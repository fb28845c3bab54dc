#include "object_follower.h"

#include <algorithm>
#include <utility>

#include "mono_pose_tracker/features/matching.h"
#include "tracking/two_motions.h"

namespace mono_pose_tracker {

constexpr ObjectFollowerOptions kFollower{};

bool ObjectFollower::follow(const TrackerOptions& options, Frame* frame) {
  known_.assign(frame->image->size(), FeatureMotion::kUnknown);
  for (const Match& m :
       match_descriptors(last_.image->set.descriptors, frame->image->set.descriptors, options.matching)) {
    known_[m.second] = last_.sides[m.first];
  }
  const std::vector<cv::Point2f> turning = known_pixels(*frame->image, FeatureMotion::kTurns);
  if (turning.size() < kFollower.min_features) return false;
  *frame = settle(*frame, turning);
  return true;
}

Frame ObjectFollower::settle(const Frame& frame, const std::vector<cv::Point2f>& inliers) {
  divide(frame.image, inliers);
  std::vector<char> turns;
  for (const FeatureMotion side : last_.sides) turns.push_back(side == FeatureMotion::kTurns);
  Frame of_object = frame;
  of_object.unmasked = frame.image;
  of_object.keep_masked_features(select_features(*frame.image, turns));
  return of_object;
}

void ObjectFollower::settle(const std::vector<cv::Point2f>& inliers) {
  if (inliers.size() >= kFollower.min_features) divide(last_.image, inliers);
}

std::vector<cv::Point2f> ObjectFollower::known_pixels(const ImageFeatures& image, FeatureMotion side) const {
  std::vector<cv::Point2f> pixels;
  for (int f = 0; f < image.size(); ++f) {
    const Eigen::Vector2f& pixel = image.set.features[f].pixel;
    if (known_[f] == side) pixels.emplace_back(pixel.x(), pixel.y());
  }
  return pixels;
}

void ObjectFollower::divide(ImageFeaturesPtr image, const std::vector<cv::Point2f>& turning) {
  const std::vector<char> nearer =
      features_of_object(*image, turning, known_pixels(*image, FeatureMotion::kMovesOtherwise));
  last_.sides.clear();
  for (int f = 0; f < image->size(); ++f) {
    const Eigen::Vector2f& pixel = image->set.features[f].pixel;
    // Features that registered the object belong to it, whatever they were assigned to before.
    const bool registered =
        std::find(turning.begin(), turning.end(), cv::Point2f(pixel.x(), pixel.y())) != turning.end();
    const bool turns =
        known_[f] == FeatureMotion::kUnknown ? nearer[f] != 0 : known_[f] == FeatureMotion::kTurns;
    last_.sides.push_back(registered || turns ? FeatureMotion::kTurns : FeatureMotion::kMovesOtherwise);
  }
  last_.image = std::move(image);
}

}  // namespace mono_pose_tracker
