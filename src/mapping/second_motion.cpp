#include "mapping/second_motion.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/nearest_vote.h"
#include "geometry/essential.h"
#include "mono_pose_tracker/robust/relative_pose.h"
#include "rotation_in_view.h"

namespace mono_pose_tracker {

namespace {

// A match contradicts a motion beyond twice RANSAC's threshold; below that it may be noise of a pose.
constexpr double kContradicts = 2;
// Fewer matches agree on a motion by accident: each of n wrong ones does with a probability of a few per cent
// (threshold over half the image height), and five are fitted.
constexpr int kMinMembers = 15;
// Share of the matches that contradict the mapped object. Wrong matches and other moving points are among
// these.
constexpr double kMinShare = 0.4;
// SIFT hardly matches objects that rotate by more than 60 degrees between two images (Lowe 2004, fig. 12:
// less than half from 50 on), which is 0.6 rad in units of rotation_in_view. Beyond are matches of similar
// objects, such as two wheels of a car.
constexpr double kMaxRotation = 0.6;
// Nearest features of known motion that vote on features that obey both.
constexpr std::size_t kVoters = 5;

bool is_on_line(const Eigen::Matrix3d& essential, const Eigen::Vector3d& bearing1,
                const Eigen::Vector3d& bearing2, double limit) {
  return std::abs(sampson_error(essential, bearing1, bearing2)) < limit;
}

// Points behind a camera contradict as well, by however little: in a map that is constrained by a skyline, or
// followed a hand, the far points that intersect behind the cameras are the evidence.
bool obeys(const Rigid3& second_from_first, const Eigen::Matrix3d& essential, const Eigen::Vector3d& bearing1,
           const Eigen::Vector3d& bearing2, double limit) {
  return is_on_line(essential, bearing1, bearing2, limit) &&
         is_in_front(second_from_first, bearing1, bearing2);
}

std::vector<char> agree_with(const std::vector<Match>& matches, const FeatureSet& first,
                             const FeatureSet& second, const Rigid3& second_from_first, double limit) {
  const Eigen::Matrix3d essential = essential_matrix(second_from_first);
  std::vector<char> agree;
  for (const Match& m : matches) {
    agree.push_back(
        obeys(second_from_first, essential, first.bearings[m.first], second.bearings[m.second], limit));
  }
  return agree;
}

double rotation_of_members(const std::vector<Eigen::Vector3d>& bearings1,
                           const std::vector<Eigen::Vector3d>& bearings2,
                           const std::vector<char>& is_member) {
  std::vector<Eigen::Vector3d> of_members1, of_members2;
  for (std::size_t i = 0; i < is_member.size(); ++i) {
    if (!is_member[i]) continue;
    of_members1.push_back(bearings1[i]);
    of_members2.push_back(bearings2[i]);
  }
  return rotation_in_view(of_members1, of_members2);
}

// The motion of the matches that contradict the mapped object; none when they do not agree on one, or on one
// that could not be matched.
RelativePoseReport fit_the_rest(const std::vector<Match>& matches, const std::vector<char>& of_object,
                                const FeatureSet& first, const FeatureSet& second,
                                const RansacOptions& ransac) {
  std::vector<Eigen::Vector3d> bearings1, bearings2;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (of_object[i]) continue;
    bearings1.push_back(first.bearings[matches[i].first]);
    bearings2.push_back(second.bearings[matches[i].second]);
  }
  if (static_cast<int>(bearings1.size()) < kMinMembers) return {};
  RelativePoseOptions options;
  options.ransac = ransac;
  options.without_accidental_matches = false;  // another object's matches are localised
  RelativePoseReport report = estimate_relative_pose(bearings1, bearings2, options);
  if (!report.success) return report;
  const int members = report.hypotheses[0].num_inliers;
  report.success = members >= kMinMembers && members >= kMinShare * static_cast<double>(bearings1.size()) &&
                   rotation_of_members(bearings1, bearings2, report.hypotheses[0].inliers) < kMaxRotation;
  return report;
}

// Whether most of the nearest features of known motion have the second motion.
bool is_among_others(const std::vector<Match>& matches, const std::vector<ObeyedMotion>& motions,
                     const std::vector<Feature>& features, const Eigen::Vector2f& pixel) {
  DistantVotes known;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (motions[i] != ObeyedMotion::kObject && motions[i] != ObeyedMotion::kOther) continue;
    known.emplace_back((features[matches[i].second].pixel - pixel).squaredNorm(),
                       motions[i] == ObeyedMotion::kOther);
  }
  return most_of_nearest(kVoters, std::move(known));
}

}  // namespace

PairMotions compare_motions(const RegisteredImage& first, const RegisteredImage& second,
                            const MatchOptions& matching, const RansacOptions& ransac, FarBehind far) {
  return motions_of(match_descriptors(first.image->set.descriptors, second.image->set.descriptors, matching),
                    first, second, ransac, far);
}

PairMotions motions_of(std::vector<Match> matches, const RegisteredImage& first,
                       const RegisteredImage& second, const RansacOptions& ransac, FarBehind far) {
  const FeatureSet &set1 = first.image->set, &set2 = second.image->set;
  PairMotions pair;
  pair.matches = std::move(matches);
  const double limit = kContradicts * ransac.threshold;
  const Rigid3 second_from_first = second.camera_from_map * first.camera_from_map.inverse();
  std::vector<char> of_object = agree_with(pair.matches, set1, set2, second_from_first, limit);
  std::vector<char> behind(of_object.size(), 0);
  if (far == FarBehind::kIsNoise) behind = far_matches(pair.matches, first, second, ransac).behind;
  for (std::size_t i = 0; i < behind.size(); ++i) of_object[i] |= behind[i];
  for (const char obeys_object : of_object)
    pair.obeyed.push_back(obeys_object ? ObeyedMotion::kObject : ObeyedMotion::kNeither);
  const RelativePoseReport rest = fit_the_rest(pair.matches, of_object, set1, set2, ransac);
  pair.has_other = rest.success;
  if (!rest.success) return pair;
  pair.other_second_from_first = rest.hypotheses[0].second_from_first;
  const std::vector<char> of_other =
      agree_with(pair.matches, set1, set2, pair.other_second_from_first, limit);
  for (std::size_t i = 0; i < pair.matches.size(); ++i) {
    if (of_other[i] || behind[i]) pair.obeyed[i] = of_object[i] ? ObeyedMotion::kBoth : ObeyedMotion::kOther;
  }
  return pair;
}

FarMatches far_matches(const std::vector<Match>& matches, const RegisteredImage& first,
                       const RegisteredImage& second, const RansacOptions& ransac) {
  const Rigid3 second_from_first = second.camera_from_map * first.camera_from_map.inverse();
  const Eigen::Matrix3d rotation = second_from_first.rotation_matrix();
  FarMatches far;
  for (const Match& m : matches) {
    const Eigen::Vector3d &bearing1 = first.image->set.bearings[m.first],
                          &bearing2 = second.image->set.bearings[m.second];
    const bool is_far = (rotation * bearing1 - bearing2).norm() < ransac.threshold;
    far.count += is_far;
    far.behind.push_back(is_far && !is_in_front(second_from_first, bearing1, bearing2));
  }
  return far;
}

int count_off_epipolar_lines(const std::vector<Match>& matches, const RegisteredImage& first,
                             const RegisteredImage& second, const RansacOptions& ransac) {
  const double limit = kContradicts * ransac.threshold;
  const FeatureSet &set1 = first.image->set, &set2 = second.image->set;
  const Eigen::Matrix3d essential =
      essential_matrix(second.camera_from_map * first.camera_from_map.inverse());
  return static_cast<int>(std::count_if(matches.begin(), matches.end(), [&](const Match& m) {
    return !is_on_line(essential, set1.bearings[m.first], set2.bearings[m.second], limit);
  }));
}

SecondMotion second_motion_in(const PairMotions& pair, const ImageFeatures& first,
                              const ImageFeatures& second) {
  if (!pair.has_other) return {};
  const std::vector<Feature>& features2 = second.set.features;
  SecondMotion found;
  found.of_first.assign(first.set.features.size(), 0);
  found.of_second.assign(features2.size(), 0);
  for (std::size_t i = 0; i < pair.matches.size(); ++i) {
    const Match& m = pair.matches[i];
    const bool is_other = pair.obeyed[i] == ObeyedMotion::kOther ||
                          (pair.obeyed[i] == ObeyedMotion::kBoth &&
                           is_among_others(pair.matches, pair.obeyed, features2, features2[m.second].pixel));
    found.of_first[m.first] = found.of_second[m.second] = is_other;
  }
  return found;
}

}  // namespace mono_pose_tracker
