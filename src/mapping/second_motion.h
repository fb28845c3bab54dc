#pragma once

#include <vector>

#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// What a match obeys: the motion of the body that the map is of, the second one, by chance or as it says
/// nothing both, or neither.
enum class ObeyedMotion { kNeither, kObject, kOther, kBoth };

/// The matches of two images, by descriptors alone. Without a second motion none obeys it.
struct PairMotions {
  bool has_other = false;
  std::vector<Match> matches;
  std::vector<ObeyedMotion> obeyed;  // one a match
  Rigid3 other_second_from_first;    // the second motion, where there is one; its translation has length 1
};

/// An image and where it was taken from, as a map says.
struct RegisteredImage {
  std::int64_t frame_index = 0;
  Rigid3 camera_from_map;
  ImageFeaturesPtr image;
};

inline RegisteredImage registered_image(const Keyframe& k) {
  return {k.frame_index, k.camera_from_map, k.image};
}

/// What is so far that nothing but the turn shows in it, to within RANSAC's threshold, and of that what lies
/// behind the cameras: noise puts half of it there.
struct FarMatches {
  int count = 0;
  std::vector<char> behind;  // one flag a match
};
FarMatches far_matches(const std::vector<Match>& matches, const RegisteredImage& first,
                       const RegisteredImage& second, const RansacOptions& ransac);

/// Whether what is far and behind the cameras contradicts the poses, or says nothing: then it obeys both
/// motions.
enum class FarBehind { kContradicts, kIsNoise };

/// The matches that contradict the images' poses must agree on one rigid motion of their own, which chance
/// does not bring about: wrong matches agree on none. (A background that stands still behind a body that
/// turns about an upright axis hardly contradicts it in two views: that is for find_two_motions.)
PairMotions compare_motions(const RegisteredImage& first, const RegisteredImage& second,
                            const MatchOptions& matching, const RansacOptions& ransac,
                            FarBehind far = FarBehind::kContradicts);

/// The same of matches that are known.
PairMotions motions_of(std::vector<Match> matches, const RegisteredImage& first,
                       const RegisteredImage& second, const RansacOptions& ransac,
                       FarBehind far = FarBehind::kContradicts);

/// How many matches lie off the lines on which the images' poses have them, by more than noise of a pose.
/// Rays that meet behind the cameras are not counted: by noise half of those of what is far do.
int count_off_epipolar_lines(const std::vector<Match>& matches, const RegisteredImage& first,
                             const RegisteredImage& second, const RansacOptions& ransac);

/// Which features of two images move as one with each other, but not with the body that the map is of: a
/// background behind an object that turns before a camera in the hand, the shoulders below a head. One flag a
/// feature; both empty when there is no such motion.
struct SecondMotion {
  std::vector<char> of_first, of_second;
};

/// Of two images that were compared. What obeys both motions (it does by chance along an epipolar line) goes
/// with the nearest features that obey one of them only.
SecondMotion second_motion_in(const PairMotions& pair, const ImageFeatures& first,
                              const ImageFeatures& second);

}  // namespace mono_pose_tracker
