#pragma once

#include <vector>

#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// The motion that a match obeys: that of the mapped object, the second one, both (by chance or because the
/// match is uninformative), or neither.
enum class ObeyedMotion { kNeither, kObject, kOther, kBoth };

/// Matches of two images by descriptors alone, and their motions. Without a second motion no match obeys
/// kOther.
struct PairMotions {
  bool has_other = false;
  std::vector<Match> matches;
  std::vector<ObeyedMotion> obeyed;  // one for each match
  Rigid3 other_second_from_first;    // the second motion, where there is one; its translation has length 1
};

/// An image with the pose that a map gives it.
struct RegisteredImage {
  std::int64_t frame_index = 0;
  Rigid3 camera_from_map;
  ImageFeaturesPtr image;
};

inline RegisteredImage registered_image(const Keyframe& k) {
  return {k.frame_index, k.camera_from_map, k.image};
}

/// Matches whose parallax is below RANSAC's threshold after the rotation is removed, and those of them that
/// triangulate behind the cameras. Noise puts half of the far matches there.
struct FarMatches {
  int count = 0;
  std::vector<char> behind;  // one flag for each match
};
FarMatches far_matches(const std::vector<Match>& matches, const RegisteredImage& first,
                       const RegisteredImage& second, const RansacOptions& ransac);

/// Whether far matches behind the cameras contradict the poses, or are noise and obey both motions.
enum class FarBehind { kContradicts, kIsNoise };

/// Splits matches into motions. Matches that contradict the images' poses must agree on one rigid motion of
/// their own; accidental matches do not. (A static background behind an object that rotates about a vertical
/// axis hardly contradicts its motion in two views: see find_two_motions.)
PairMotions compare_motions(const RegisteredImage& first, const RegisteredImage& second,
                            const MatchOptions& matching, const RansacOptions& ransac,
                            FarBehind far = FarBehind::kContradicts);

/// The same for given matches.
PairMotions motions_of(std::vector<Match> matches, const RegisteredImage& first,
                       const RegisteredImage& second, const RansacOptions& ransac,
                       FarBehind far = FarBehind::kContradicts);

/// Number of matches off their epipolar lines by more than the noise of a pose. Rays that intersect behind
/// the cameras are not counted: noise puts half of the far points there.
int count_off_epipolar_lines(const std::vector<Match>& matches, const RegisteredImage& first,
                             const RegisteredImage& second, const RansacOptions& ransac);

/// Features of two images that share a rigid motion other than that of the mapped object: a background behind
/// an object that rotates before a hand-held camera, the shoulders below a head. One flag for each feature;
/// both empty when there is no such motion.
struct SecondMotion {
  std::vector<char> of_first, of_second;
};

/// The second motion of two compared images. Matches that obey both motions (by chance along an epipolar
/// line) are assigned to the motion of the nearest features that obey only one.
SecondMotion second_motion_in(const PairMotions& pair, const ImageFeatures& first,
                              const ImageFeatures& second);

}  // namespace mono_pose_tracker
