#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "mapping/second_motion.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// A feature matched between two images, and whether it moves with the mapped object.
struct MotionTrack {
  std::int64_t from_index = 0, to_index = 0;  // of the images
  Eigen::Vector2f from, to;                   // pixels
  bool is_other = false;
};

/// A rigid motion in the keyframes of a finished map other than that of the mapped object: a head above the
/// mapped shoulders, the shoulders below a mapped head, the room behind it.
struct IndependentMotion {
  int pairs = 0, other_pairs = 0;  // of keyframes: compared; with a second motion
  long matches = 0, obeying = 0;   // of these pairs, by descriptors alone; explained by the map's poses
  /// Rotations of the two objects in front of the camera between keyframes that show both, summed (rad, about
  /// a third of the angle): the motion within the object that no camera rotation explains, divided by its
  /// size. The displacement in the image is not used: the background of a hand-held camera moves far and
  /// hardly rotates.
  double map_rotation = 0, other_rotation = 0;
  /// The part of other_rotation from pairs in which the other object rotates plainly farther than the mapped
  /// one. An object in front of a room does so all the time; a map that mixes both objects does so in a part
  /// of it.
  double other_rotation_alone = 0;
  std::vector<MotionTrack> tracks;  // between consecutive images
  double cell_px = 0;               // side of the image cells of share_of_view

  /// Accidental matches agree on a motion in few pairs; an object does in at least every fourth.
  bool exists() const { return other_pairs > 0 && 4 * other_pairs >= pairs; }
  /// A weaker condition, for the search of an object that rotates: two objects with little relative motion
  /// show it in few pairs. A single texture shows it in one of about two hundred pairs, never in three of
  /// thirty; a room with repeated structure may.
  bool may_exist() const { return exists() || (other_pairs >= 3 && 10 * other_pairs >= pairs); }
  /// Share of the tracks that belong to the other object.
  double share() const;
  /// Share of the view: of the image cells that show either object, those that mostly show the other one. A
  /// screen full of letters has most of the features, but the room around it fills the view.
  double share_of_view() const;
  /// Share of the matches that the map explains.
  double explained() const {
    return matches > 0 ? static_cast<double>(obeying) / static_cast<double>(matches) : 0;
  }
  /// Whether the other object could be the one that the user wants.
  bool is_comparable() const { return exists() && (share() > kComparable || share_of_view() > kMostOfView); }
  /// Whether the other object is larger than the mapped one, by more than a few wrong matches could cause.
  bool is_larger() const { return exists() && share() > kLarger; }
  /// Whether the other object plainly rotates less than the mapped one: the ratio has a margin of a half, as
  /// rotations are accurate to a tenth or two, and it holds all the time.
  bool rotates_plainly_less() const {
    return map_rotation > kPlainly * other_rotation && other_rotation_alone < kRotatesAlone;
  }

  static constexpr double kPlainly = 1.5, kComparable = 0.25, kLarger = 0.55, kMostOfView = 0.5;
  static constexpr double kRotatesAlone =
      0.05;  // about nine degrees; right maps of ten recordings have 0.029 at most
};

/// Images to compare: the keyframes alone, or also the images between them.
enum class ComparedImages { kKeyframes, kAllSeen };

/// Matches keyframes near in time again by descriptors alone, since a map holds only consistent observations.
/// A feature that obeys only one of the two motions decides for its whole track. seen: images with all their
/// features and their poses in the map, by frame. They replace the keyframes' own features. Images between
/// keyframes (kAllSeen) show objects that rotate too far between keyframes for matching, or while no keyframe
/// was made. The result is the same for any number of threads.
IndependentMotion find_independent_motion(const Map& map, const std::vector<RegisteredImage>& seen,
                                          ComparedImages asked, const MatchOptions& matching,
                                          const RansacOptions& ransac, int threads);

/// The same from about thirty pairs of consecutive keyframes spread over the recording, at a cost independent
/// of the map's size. camera_goes_through: the map is of a place, so ego-vehicle features and overlaid text
/// are no object. is_connected: the map is complete; far points behind the cameras are then ignored, unless
/// there are more than noise explains.
IndependentMotion sample_independent_motion(const Map& map, const MatchOptions& matching,
                                            const RansacOptions& ransac, bool camera_goes_through,
                                            bool is_connected, int threads);

/// Rotation of the features with this motion between the two images, as in IndependentMotion; 0 for fewer
/// than five matches.
double rotation_between(const RegisteredImage& first, const RegisteredImage& second, const PairMotions& pair,
                        ObeyedMotion motion);

/// The angle that the cameras span around the mapped object, seen from its centroid (rad): the rotation of
/// the object in front of them.
double rotation_before_cameras(const Map& map);

}  // namespace mono_pose_tracker
