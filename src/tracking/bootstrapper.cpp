#include "tracking/bootstrapper.h"

#include <algorithm>
#include <cmath>

#include "common/statistics.h"
#include "common/text.h"
#include "mapping/depth_reversal.h"
#include "mono_pose_tracker/robust/relative_pose.h"
#include "view_hypothesis.h"

namespace mono_pose_tracker {

namespace {

RelativePoseReport relative_pose(const ViewSet& views, const TrackerOptions& options,
                                 BootstrapReport* report) {
  std::vector<Eigen::Vector3d> bearings1, bearings2;
  for (const Track& track : views.tracks) {
    bearings1.push_back(views.images[0]->set.bearings[track.feature_of_view[0]]);
    bearings2.push_back(views.images[1]->set.bearings[track.feature_of_view[1]]);
  }
  RelativePoseOptions pose_options;
  pose_options.ransac = options.ransac(views.focal_px);
  pose_options.without_accidental_matches = false;  // repeated structure is matched with its neighbour
  RelativePoseReport pose = estimate_relative_pose(bearings1, bearings2, pose_options);

  // The motion that the best rotation leaves, to be explained by a translation.
  std::vector<double> moved, left_over;
  for (std::size_t i = 0; i < bearings1.size(); ++i) {
    moved.push_back(std::acos(std::clamp(bearings1[i].dot(bearings2[i]), -1.0, 1.0)));
    left_over.push_back(
        std::acos(std::clamp((pose.rotation_only * bearings1[i]).dot(bearings2[i]), -1.0, 1.0)));
  }
  const double rotation_share = static_cast<double>(pose.rotation_only_inliers) / bearings1.size();
  const double moved_px = median(moved) * views.focal_px;
  report->matches = static_cast<int>(bearings1.size());
  report->inliers = pose.success ? pose.hypotheses[0].num_inliers : 0;
  report->median_parallax_deg = median(left_over) / kDegree;
  if (moved_px < options.bootstrap.min_parallax_px) {
    report->reason = Reason::kLowParallax;
    report->text =
        formatted("too little parallax: the image moved by %.1f px since the reference, %.1f needed",
                  moved_px, options.bootstrap.min_parallax_px);
  } else if (rotation_share > options.bootstrap.max_rotation_only) {
    report->reason = Reason::kRotationOnly;
    report->text =
        formatted("too little parallax: a rotation alone explains %.0f %% of %d matches, %.0f %% at most",
                  100 * rotation_share, report->matches, 100 * options.bootstrap.max_rotation_only);
  } else if (!pose.success || report->inliers < options.bootstrap.min_landmarks) {
    report->reason = Reason::kTooFewInliers;
    report->text = formatted("%d of %d matches fit one rigid motion, %d needed", report->inliers,
                             report->matches, options.bootstrap.min_landmarks);
  } else {
    report->reason = Reason::kOk;
  }
  return pose;
}

// Grown hypotheses in the order of their cost, each geometry once.
std::vector<ViewHypothesis> grow_all(const ViewSet& views, const RelativePoseReport& pose,
                                     const TrackerOptions& options) {
  std::vector<ViewHypothesis> grown;
  for (const RelativePoseHypothesis& h : pose.hypotheses) {
    grown.push_back(grow_hypothesis(views, h.second_from_first, h.inliers, options));
  }
  std::stable_sort(grown.begin(), grown.end(), [](const auto& a, const auto& b) { return a.cost < b.cost; });
  std::vector<ViewHypothesis> distinct;
  for (ViewHypothesis& h : grown) {
    const bool known = std::any_of(distinct.begin(), distinct.end(), [&](const ViewHypothesis& d) {
      return is_same_geometry(d.cameras_from_map[1], h.cameras_from_map[1], kBootstrapper.same_rotation,
                              kBootstrapper.same_translation);
    });
    if (!known) distinct.push_back(std::move(h));
  }
  return distinct;
}

// Whether the cost of the runner-up is high enough. An object, like anything in a narrow view, hardly
// separates its alternatives over time: its map is begun anyway and corrected as it grows
// (mapping/depth_reversal.h).
bool has_evidence(const ViewSet& views, const ViewHypothesis& best, const ViewHypothesis& alternative,
                  const TrackerOptions& options) {
  const double more = alternative.cost - best.cost;
  if (options.bootstrap.min_evidence == 0) return true;
  if (more < options.bootstrap.min_evidence * best.cost) return false;
  if (!views.has_horizon) return true;
  std::vector<Eigen::Vector3d> bearings;
  std::ptrdiff_t observations = 0;
  for (const Track& track : views.tracks) {
    const std::vector<int>& seen = track.feature_of_view;
    bearings.push_back(views.images[0]->set.bearings[seen[0]]);
    observations += std::count_if(seen.begin(), seen.end(), [](int f) { return f >= 0; });
  }
  if (is_narrow(bearings)) return true;
  const double usual = best.cost / static_cast<double>(observations);
  const double out = options.inlier_threshold_px * options.inlier_threshold_px;
  return more >= std::min(kBootstrapper.min_evidence * usual, kBootstrapper.min_evidence_outliers * out);
}

// Whether the best of the hypotheses is good enough for a map; the report has the reason if not.
bool judge(const ViewSet& views, const std::vector<ViewHypothesis>& hypotheses, const TrackerOptions& options,
           BootstrapReport* report) {
  const BootstrapOptions& limits = options.bootstrap;
  const ViewHypothesis& best = hypotheses[0];
  const double parallax = median_parallax(views, best);
  report->median_parallax_deg = parallax / kDegree;
  report->inliers = best.num_points;
  if (best.num_points < limits.min_landmarks) {
    report->reason = Reason::kTooFewInliers;
    report->text =
        formatted("%d points agree in all views, %d needed", best.num_points, limits.min_landmarks);
  } else if (report->median_parallax_deg < limits.min_parallax_deg ||
             parallax * views.focal_px < limits.min_parallax_px) {
    report->reason = Reason::kLowParallax;
    report->text = formatted("too little parallax: median %.2f deg (%.1f px), %.2f deg and %.1f px needed",
                             report->median_parallax_deg, parallax * views.focal_px, limits.min_parallax_deg,
                             limits.min_parallax_px);
  } else if (best.confirmed < limits.min_confirmed) {
    report->reason = Reason::kAwaitingConfirmation;
    report->text = formatted("a third view confirms %.0f %% of the points, %.0f %% needed",
                             100 * best.confirmed, 100 * limits.min_confirmed);
  } else if (hypotheses.size() > 1 && !has_evidence(views, best, hypotheses[1], options)) {
    report->reason = Reason::kAmbiguousPose;
    report->text = formatted("an alternative geometry of the %d matches fits within %.1f %% of the best",
                             report->matches, 100 * (hypotheses[1].cost / best.cost - 1));
  } else {
    report->reason = Reason::kOk;
    report->text = formatted("map of %d points from %d views, median parallax %.2f deg", best.num_points,
                             static_cast<int>(views.images.size()), report->median_parallax_deg);
    return true;
  }
  return false;
}

InitialMap to_map(const ViewSet& views, const std::vector<Frame>& frames, const ViewHypothesis& h) {
  InitialMap map;
  std::vector<int> order(frames.size());
  for (std::size_t v = 0; v < frames.size(); ++v) order[v] = static_cast<int>(v);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return frames[a].index < frames[b].index; });
  for (const int v : order) map.views.push_back({frames[v], h.cameras_from_map[v]});
  for (std::size_t i = 0; i < views.tracks.size(); ++i) {
    if (!h.is_point[i]) continue;
    InitialMap::Point point;
    point.x_in_map = h.points[i];
    for (std::size_t k = 0; k < order.size(); ++k) {
      const int f = views.tracks[i].feature_of_view[order[k]];
      if (f >= 0) point.observations.emplace_back(static_cast<int>(k), f);
    }
    map.points.push_back(std::move(point));
  }
  return map;
}

}  // namespace

int Bootstrapper::match_to_reference(Candidate* candidate) const {
  const ImageFeatures& reference = *candidates_.front().frame.image;
  candidate->feature_of_reference.assign(reference.size(), -1);
  const std::vector<Match> matches = match_descriptors(
      reference.set.descriptors, candidate->frame.image->set.descriptors, options_.matching);
  for (const Match& m : matches) candidate->feature_of_reference[m.first] = m.second;
  candidate->matches = static_cast<int>(matches.size());
  return candidate->matches;
}

// Makes the oldest frame with enough matches to the newest the new reference. Returns false when there is
// none.
bool Bootstrapper::replace_reference() {
  while (candidates_.size() > 1) {
    candidates_.pop_front();
    if (candidates_.size() == 1) break;
    if (match_to_reference(&candidates_.back()) < options_.bootstrap.min_matches) continue;
    if (has_left_reference()) continue;
    for (std::size_t i = 1; i + 1 < candidates_.size(); ++i) match_to_reference(&candidates_[i]);
    return true;
  }
  match_to_reference(&candidates_.front());
  forget_motions();
  return false;
}

// Whether the view has moved on and the remaining matches with the reference are mostly ego-vehicle features
// or wrong.
bool Bootstrapper::has_left_reference() const {
  if (candidates_.size() < 3 || !still_.empty()) return false;
  const double far = 2 * options_.bootstrap.min_parallax_px;
  const Candidate &newest = candidates_.back(), &before = candidates_[candidates_.size() - 2];
  const FeatureSet &to = newest.frame.image->set, &from = before.frame.image->set,
                   &reference = candidates_.front().frame.image->set;
  const auto is_far = [&](const Feature& a, const Feature& b) { return (b.pixel - a.pixel).norm() > far; };
  std::ptrdiff_t far_of_reference = 0;
  for (std::size_t f = 0; f < newest.feature_of_reference.size(); ++f) {
    const int matched = newest.feature_of_reference[f];
    far_of_reference += matched >= 0 && is_far(reference.features[f], to.features[matched]);
  }
  if (2 * far_of_reference >= newest.matches) return false;
  const std::vector<Match> matches = match_descriptors(from.descriptors, to.descriptors, options_.matching);
  const auto going_on = std::count_if(matches.begin(), matches.end(), [&](const Match& m) {
    return is_far(from.features[m.first], to.features[m.second]);
  });
  return going_on >= options_.bootstrap.min_matches &&
         going_on > kBootstrapper.left_reference * far_of_reference;
}

// Thins the frames of a camera at rest to every other one: third views do not need more.
void Bootstrapper::thin_out() {
  if (static_cast<int>(candidates_.size()) <= options_.bootstrap.max_frames) return;
  std::deque<Candidate> kept;
  if (camera_is_still_) {
    // The older half has no more information than the newer, but an object that has appeared since is only in
    // the newer.
    candidates_.erase(candidates_.begin(),
                      candidates_.begin() + static_cast<std::ptrdiff_t>(candidates_.size() / 2));
    for (Candidate& candidate : candidates_) match_to_reference(&candidate);
    return;
  }
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    if (i % 2 == 0 || i + 1 == candidates_.size()) kept.push_back(std::move(candidates_[i]));
  }
  candidates_ = std::move(kept);
}

void Bootstrapper::reset() {
  candidates_.clear();
  forget_motions();
}

void Bootstrapper::forget_motions() {
  still_.clear();
  two_motions_seen_ = 0;
  view_reached_round_ = false;
  camera_is_still_ = false;
}

// Up to three views between the reference and the second one: at the middle and the quarters.
std::vector<int> Bootstrapper::third_views(std::size_t second) const {
  std::vector<int> chosen;
  for (const double share : {0.5, 0.25, 0.75}) {
    const int i = static_cast<int>(std::lround(share * second));
    if (i <= 0 || i >= static_cast<int>(second)) continue;
    if (std::find(chosen.begin(), chosen.end(), i) != chosen.end()) continue;
    if (candidates_[i].matches >= options_.bootstrap.min_matches) chosen.push_back(i);
  }
  return chosen;
}

// Collects the tracks of the reference's features that the second used view (the pair's other half) observes
// and that are not ego-vehicle features.
ViewSet Bootstrapper::collect(const std::vector<int>& used, const std::vector<char>& fixed,
                              std::vector<Frame>* frames) const {
  ViewSet views;
  views.focal_px = camera_.focal();
  views.has_horizon =
      !options_.segmentation.wants_turning_object() && !candidates_.front().frame.is_of_object;
  for (const int i : used) {
    views.images.push_back(candidates_[i].frame.image);
    frames->push_back(candidates_[i].frame);
  }
  const std::vector<int>& second = candidates_[used[1]].feature_of_reference;
  for (std::size_t f = 0; f < second.size(); ++f) {
    if (second[f] < 0 || (!fixed.empty() && fixed[f])) continue;
    Track track;
    for (const int i : used) {
      track.feature_of_view.push_back(i == 0 ? static_cast<int>(f) : candidates_[i].feature_of_reference[f]);
    }
    views.tracks.push_back(std::move(track));
  }
  return views;
}

BootstrapReport Bootstrapper::add(const Frame& frame) {
  BootstrapReport report;
  if (frame.image->size() < options_.bootstrap.min_features) {
    report.reason = Reason::kTooFewFeatures;
    report.text = formatted("%d features, %d needed", frame.image->size(), options_.bootstrap.min_features);
    return report;
  }
  candidates_.push_back({frame, {}, 0});
  if (candidates_.size() == 1) {
    match_to_reference(&candidates_.front());
    return report;
  }
  thin_out();
  const int matches = match_to_reference(&candidates_.back());
  if ((matches < options_.bootstrap.min_matches || has_left_reference()) && !replace_reference()) {
    report.reason = Reason::kTooFewMatches;
    report.matches = matches;
    report.text = matches < options_.bootstrap.min_matches
                      ? formatted("%d matches to the reference frame, %d needed: it is replaced", matches,
                                  options_.bootstrap.min_matches)
                      : "only ego-vehicle features of the reference frame are still in view: it is replaced";
    return report;
  }

  std::vector<char> fixed;
  if (!separate_motions(&fixed, &report)) return report;

  std::vector<int> used = third_views(candidates_.size() - 1);
  used.insert(used.begin(), {0, static_cast<int>(candidates_.size()) - 1});
  find_map(used, fixed, options_, &report);
  if (!report.map) return report;
  report.map->views.front().fixed = fixed;  // the reference is the oldest
  if (!still_.empty()) report_motions(&report);
  return report;
}

void Bootstrapper::find_map(const std::vector<int>& used, const std::vector<char>& fixed,
                            const TrackerOptions& options, BootstrapReport* report) const {
  std::vector<Frame> frames;
  const ViewSet views = collect(used, fixed, &frames);
  const RelativePoseReport pose = relative_pose(views, options, report);
  if (report->reason != Reason::kOk) return;
  const std::vector<ViewHypothesis> hypotheses = grow_all(views, pose, options);
  if (judge(views, hypotheses, options, report)) report->map = to_map(views, frames, hypotheses[0]);
}

std::vector<SeenMotion> Bootstrapper::motions() const {
  std::vector<SeenMotion> motions;
  if (candidates_.size() < 2) return motions;
  const ImageFeatures& reference = *candidates_.front().frame.image;
  const ImageFeatures& newest = *candidates_.back().frame.image;
  const std::vector<int>& matched = candidates_.back().feature_of_reference;
  for (std::size_t f = 0; f < matched.size(); ++f) {
    if (matched[f] < 0) continue;
    motions.push_back({reference.set.features[f].pixel, newest.set.features[matched[f]].pixel});
  }
  return motions;
}

BootstrapReport Bootstrapper::unconfirmed() const {
  BootstrapReport report;
  if (candidates_.size() < 2) {
    report.text = "fewer than two frames share matches";
    report.reason = Reason::kTooFewMatches;
    return report;
  }
  TrackerOptions two_view = options_;
  two_view.bootstrap.min_confirmed = 0;
  two_view.bootstrap.min_evidence = 0;
  find_map({0, static_cast<int>(candidates_.size()) - 1}, {}, two_view, &report);
  return report;
}

}  // namespace mono_pose_tracker
