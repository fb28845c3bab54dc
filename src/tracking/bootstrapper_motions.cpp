// The part of the Bootstrapper that separates an object, a static background and ego-vehicle features.

#include <algorithm>

#include "common/statistics.h"
#include "common/text.h"
#include "tracking/bootstrapper.h"

namespace mono_pose_tracker {

// Reduces the candidate to the object's features, located by matches of these features of the reference.
void Bootstrapper::keep_masked_features(const std::vector<int>& moved_of_reference,
                                        Candidate* candidate) const {
  const bool is_reference = candidate == &candidates_.front();
  const ImageFeatures& image = *candidate->frame.image;
  std::vector<cv::Point2f> moved;
  for (const int f : moved_of_reference) {
    const int i = is_reference ? f : candidate->feature_of_reference[f];
    if (i >= 0) moved.emplace_back(image.set.features[i].pixel.x(), image.set.features[i].pixel.y());
  }
  candidate->frame.keep_masked_features(
      select_features(image, features_of_object(image, moved, still_, options_.cancelled)));
}

// Excludes the background's features from now on.
void Bootstrapper::begin_separation(const TwoMotions& motions) {
  still_ = motions.still;
  for (std::size_t i = candidates_.size(); i-- > 0;)
    keep_masked_features(motions.moved_of_first, &candidates_[i]);
  for (Candidate& candidate : candidates_) match_to_reference(&candidate);
}

// Reduces the newest candidate to the object's features, by those of the reference.
void Bootstrapper::separate_newest() {
  std::vector<int> matched;
  Candidate& newest = candidates_.back();
  for (std::size_t f = 0; f < newest.feature_of_reference.size(); ++f) {
    if (newest.feature_of_reference[f] >= 0) matched.push_back(static_cast<int>(f));
  }
  keep_masked_features(matched, &newest);
  match_to_reference(&newest);
}

// Flags of the reference's features that moved in at least two images between it and the newest (one may be a
// wrong match).
std::vector<char> Bootstrapper::moved_between() const {
  const double far = options_.bootstrap.min_parallax_px;
  const std::vector<Feature>& from = candidates_.front().frame.image->set.features;
  std::vector<int> moved(from.size(), 0);
  for (std::size_t c = 1; c + 1 < candidates_.size(); ++c) {
    const std::vector<Feature>& to = candidates_[c].frame.image->set.features;
    for (std::size_t f = 0; f < from.size(); ++f) {
      const int matched = candidates_[c].feature_of_reference[f];
      moved[f] += matched >= 0 && (to[matched].pixel - from[f].pixel).norm() > far;
    }
  }
  std::vector<char> flags(moved.size());
  std::transform(moved.begin(), moved.end(), flags.begin(), [](int images) { return images >= 2; });
  return flags;
}

// Detects an object that moves in front of a static background, and excludes the background's features once
// it is certain. fixed: flags of the reference's ego-vehicle features by the newest image; empty: none known.
// Returns false when this frame cannot begin a map; the report has the reason.
bool Bootstrapper::separate_motions(std::vector<char>* fixed, BootstrapReport* report) {
  const SegmentationOptions& segmentation = options_.segmentation;
  Candidate& newest = candidates_.back();
  if (newest.frame.is_masked || !(segmentation.is_off() || segmentation.may_find_motion())) return true;
  if (!still_.empty() && !segmentation.is_off()) {
    separate_newest();
    return true;
  }
  TwoMotions motions = find_two_motions(*candidates_.front().frame.image, *newest.frame.image,
                                        newest.feature_of_reference, moved_between(), camera_, options_);
  // When the camera moves on, only the centre of the first view is left in the newest.
  view_reached_round_ = view_reached_round_ || motions.is_ego_vehicle;
  if (motions.found && view_reached_round_) {
    motions.found = false;
    motions.is_ego_vehicle = true;
  }
  camera_is_still_ = static_cast<double>(motions.still.size()) > kBootstrapper.still_camera * motions.matches;
  if (motions.is_ego_vehicle) {
    fixed->assign(candidates_.front().frame.image->size(), 0);
    for (const int f : motions.still_of_first) (*fixed)[f] = 1;
  }
  two_motions_seen_ = motions.found ? two_motions_seen_ + 1 : 0;
  report->matches = motions.matches;
  if (two_motions_seen_ >= kBootstrapper.two_motions_frames && !segmentation.is_off()) {
    camera_is_still_ = false;  // a new object is in all later candidates
    begin_separation(motions);
    return true;
  }
  if (two_motions_seen_ >= kBootstrapper.two_motions_frames) still_ = motions.still;
  return is_one_motion(motions, report);
}

// Whether there is one motion as far as is known. Otherwise the report has the reason against a map.
bool Bootstrapper::is_one_motion(const TwoMotions& motions, BootstrapReport* report) const {
  const int still = static_cast<int>(motions.still.size());
  const int moved = static_cast<int>(motions.moved_of_first.size());
  if (!still_.empty()) {
    report->reason = Reason::kStillBackground;
    report->text = formatted(
        "of %d matches %d are static, %d moved: an object moves in front of a static background. Use "
        "segmentation/method auto, or masks",
        motions.matches, still, moved);
  } else if (motions.found) {
    report->reason = Reason::kAwaitingConfirmation;
    report->text = formatted("of %d matches %d are static and %d moved as one: another image must confirm it",
                             motions.matches, still, moved);
  } else if (options_.segmentation.is_by_motion()) {
    report->reason = Reason::kAwaitingConfirmation;
    report->text =
        formatted("no object moves in front of a static background: of %d matches %d are static, %d moved",
                  motions.matches, still, moved);
  } else {
    return true;
  }
  return false;
}

void Bootstrapper::report_motions(BootstrapReport* report) const {
  report->static_background = still_;
  report->reference_index = candidates_.front().frame.index;
  const Candidate& newest = candidates_.back();
  std::vector<double> moved;
  for (std::size_t f = 0; f < newest.feature_of_reference.size(); ++f) {
    if (newest.feature_of_reference[f] < 0) continue;
    moved.push_back((newest.frame.image->set.features[newest.feature_of_reference[f]].pixel -
                     candidates_.front().frame.image->set.features[f].pixel)
                        .norm());
  }
  report->moved_px = median(std::move(moved));
}

}  // namespace mono_pose_tracker
