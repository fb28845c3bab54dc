#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/robust/ransac_options.h"

namespace mono_pose_tracker {

class ViewGraph;

/// Limits for a static background: median number of features that keep their place between neighbouring
/// images, and their share of the matches. A rigid scene in front of a moving camera has none or two.
struct LeastStill {
  double features = 0, share = 0;
};

/// Thresholds of the motion segmentation, live and at the end of a recording.
struct MotionSegmentationOptions {
  MatchOptions matching;
  RansacOptions ransac;  // threshold in rad
  int threads = 1;       // the result is the same for any number

  // A pair of images.
  double contradicts = 2;     // Sampson error, in RANSAC thresholds, from which a match contradicts a motion;
                              // below, it may be noise of a pose
  int min_members = 15;       // matches of a second motion: wrong ones agree with a probability of a few per
                              // cent each, and five are fitted
  double min_share = 0.4;     // of the matches that contradict the map; wrong matches are among these
  double max_rotation = 0.6;  // in units of rotation_in_view (60 degrees): SIFT does not match larger ones
                              // (Lowe 2004, fig. 12), but similar objects such as two wheels of a car

  std::size_t voters = 5;        // nearest features that vote on one that obeys both motions
  std::size_t min_rotating = 5;  // matches from which a rotation is estimated
  int min_features = 25;         // of an object: fewer begin no map

  // All pairs.
  int sampled_pairs = 30;     // of keyframes at each distance, where a sample is enough
  double least_pairs = 0.25;  // share of the pairs that show an object; by chance one of a hundred does
  // The same where the object that rotates is sought, and the minimum number: two objects with little
  // relative motion show it in few pairs.
  double fewest_pairs = 0.1;
  int min_pairs = 3;
  double comparable = 0.25;      // share of the matches from which the other object may be the wanted one
  double larger = 0.55;          // share of the matches from which it is larger: wrong matches cause less
  double plainly_rotates = 1.5;  // ratio of rotations, which are accurate to a tenth or two

  // Live: the newest pairs of keyframes.
  int newest_pairs = 12;
  double least_rotation = 0.015;  // rad, in units of rotation_in_view: half a pixel at an object of 60 px

  // Static background; lengths in px at 640 px (image_scale).
  double static_px = 1;      // up to it a feature has kept its place: noise, JPEG, a vibrating tripod
  double moved_px = 3;       // from it on a feature has moved
  int min_static_pairs = 3;  // image pairs that show a track in its place: one or two may be wrong matches
  int static_per_moved = 4;  // one match of five may be wrong
  LeastStill plainly_static{12, 0.08};  // a background is certain
  // Masking the static features is worth a try where a result is in doubt: only the shirt of a head before a
  // bright, noisy wall, for example.
  LeastStill faintly_static{5, 0.04};
  // Distances between compared images: neighbours have most matches, distant ones show best what has moved.
  std::array<int, 6> image_distances = {1, 2, 4, 8, 16, 32};
  int min_static_features = 5;                   // live, of the newest image: fewer do not delimit the object
  int first_keyframes = 9, last_keyframes = 12;  // live: size of a young map that is checked. In fewer images
                                                 // slow features seem static
};

MotionSegmentationOptions motion_segmentation_options(const MatchOptions& matching,
                                                      const RansacOptions& ransac, int threads);

/// The motion that a match obeys: that of the mapped object, the second one, both (by chance or because the
/// match is uninformative), or neither.
enum class ObeyedMotion { kNeither, kObject, kOther, kBoth };

/// Matches of two images and their motions. Without a second motion no match obeys kOther.
struct PairMotions {
  bool has_other = false;
  std::vector<Match> matches;
  std::vector<ObeyedMotion> obeyed;  // one for each match
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

/// Splits the raw matches of two images into motions. Matches that contradict the images' poses must agree on
/// one rigid motion of their own; accidental matches do not. graph: where it has an edge of the two images,
/// its matches are used; may be null. A static background behind an object that rotates about a vertical
/// axis hardly contradicts its motion in two views: StaticSegmentation finds it.
PairMotions compare_motions(const RegisteredImage& first, const RegisteredImage& second,
                            const MotionSegmentationOptions& options, const ViewGraph* graph = nullptr);

/// Features of two images that share a rigid motion other than that of the mapped object. Matches that obey
/// both motions are assigned to the motion of the nearest features that obey only one. One flag for each
/// feature; both empty when there is no such motion.
struct SecondMotion {
  std::vector<char> of_first, of_second;
};
SecondMotion second_motion_in(const PairMotions& pair, const ImageFeatures& first,
                              const ImageFeatures& second, const MotionSegmentationOptions& options = {});

/// What pairs of images show of a second rigid motion. It is summed over pairs: all of a finished map, or the
/// newest of a live one.
struct MotionEvidence {
  int pairs = 0, other_pairs = 0;  // compared; with a second motion
  long of_map = 0, of_other = 0;   // matches that obey only the motion of one
  /// Rotations of the two objects in front of the camera, summed over the pairs that determine
  /// both (rotation_in_view, about a third of the angle in rad). The displacement in the image is not used:
  /// the background of a hand-held camera moves far and hardly rotates.
  double map_rotation = 0, other_rotation = 0;

  MotionEvidence& operator+=(const MotionEvidence& more);
  bool exists(const MotionSegmentationOptions& options = {}) const {
    return other_pairs > 0 && other_pairs >= options.least_pairs * pairs;
  }
  /// A weaker condition, for the search of the object that rotates.
  bool may_exist(const MotionSegmentationOptions& options = {}) const {
    return exists(options) ||
           (other_pairs >= options.min_pairs && other_pairs >= options.fewest_pairs * pairs);
  }
  /// Share of the matches of all pairs that obey only the other motion: where it is rarely in view, it is
  /// small.
  double share() const;
  /// Whether the other object could be the one that the user wants.
  bool is_comparable(const MotionSegmentationOptions& options = {}) const {
    return exists(options) && share() > options.comparable;
  }
  bool is_larger(const MotionSegmentationOptions& options = {}) const {
    return exists(options) && share() > options.larger;
  }
  /// Whether the other object plainly rotates less, or more, than the mapped one.
  bool rotates_plainly_less(const MotionSegmentationOptions& options = {}) const {
    return map_rotation > options.plainly_rotates * other_rotation;
  }
  bool rotates_plainly_more(const MotionSegmentationOptions& options = {}) const {
    return other_rotation > options.plainly_rotates * map_rotation;
  }
};

/// The evidence of one pair.
MotionEvidence evidence_of(const RegisteredImage& first, const RegisteredImage& second,
                           const PairMotions& pair, const MotionSegmentationOptions& options = {});

/// A feature matched between two images, and whether it moves with the mapped object.
struct MotionTrack {
  std::int64_t from_index = 0, to_index = 0;  // of the images
  Eigen::Vector2f from, to;                   // pixels
  bool is_other = false;
};

/// A rigid motion in the images of a finished map other than that of the mapped object: a head above the
/// mapped shoulders, the shoulders below a mapped head, the room behind it.
struct IndependentMotion : MotionEvidence {
  std::vector<MotionTrack> tracks;  // between consecutive images
};

/// Images to compare: the keyframes alone, or also the images between them.
enum class ComparedImages { kKeyframes, kAllSeen };

/// Compares images near in time. A feature that obeys only one of the two motions decides for its whole
/// track. seen: images with all their features and their poses in the map, by frame. They replace the
/// keyframes' own features. Images between keyframes (kAllSeen) show objects that rotate too far between
/// keyframes for matching.
IndependentMotion find_independent_motion(const Map& map, const std::vector<RegisteredImage>& seen,
                                          ComparedImages asked, const MotionSegmentationOptions& options,
                                          const ViewGraph* graph = nullptr);

/// Evidence of about thirty pairs of keyframes at each of these distances in time, spread over the recording,
/// at a cost independent of the map's size.
MotionEvidence sample_independent_motion(const Map& map, const std::vector<int>& distances,
                                         const MotionSegmentationOptions& options,
                                         const ViewGraph* graph = nullptr);

/// The angle that the cameras span around the mapped object, seen from its centroid (rad): the rotation of
/// the object in front of them.
double rotation_before_cameras(const Map& map);

struct RotationInViewOptions {
  int rounds = 3;  // of fitting a rotation without the far matches
  double far = 3;  // medians, beyond which a match is ignored: a few wrong ones move farther than all others
                   // together
};

/// Rotation of an object in front of the camera between two images, from matched bearings (one pair for each
/// match): the motion within the object that no camera rotation explains, divided by its size in the image
/// (medians). It is about a third of the rotation angle (rad) for a ball, and up to 0.6 of it for a long,
/// flat object.
double rotation_in_view(const std::vector<Eigen::Vector3d>& bearings1,
                        const std::vector<Eigen::Vector3d>& bearings2);

}  // namespace mono_pose_tracker
