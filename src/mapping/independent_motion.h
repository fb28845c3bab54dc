#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "mapping/second_motion.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

/// A feature that is seen in two images, and whether it moves with the body that the map is of.
struct MotionTrack {
  std::int64_t from_index = 0, to_index = 0;  // of the images
  Eigen::Vector2f from, to;                   // pixels
  bool is_other = false;
};

/// What moves as one in the keyframes of a finished map, but otherwise than the map says: a head above the
/// shoulders that the map is of, or the shoulders below it, or the room behind.
struct IndependentMotion {
  int pairs = 0, other_pairs = 0;  // of keyframes: compared; with a second motion in them
  long matches = 0, obeying = 0;   // of these pairs, by descriptors alone; those that the map's poses explain
  /// How far the two turn before the camera between the keyframes that show both, summed (rad, about a third
  /// of the angle): movement within the body that no rotation of the camera explains, by the body's size.
  /// Where in the image a body is seen, and how far it went, says nothing: a background behind a camera in
  /// the hand goes far, and hardly turns.
  double map_rotation = 0, other_rotation = 0;
  /// Of other_rotation: where the other turned plainly farther than the map's body. What turns before a room
  /// does so all the time; a map that is of the one here and of the other there is overtaken in a part of it.
  double other_rotation_alone = 0;
  std::vector<MotionTrack> tracks;  // between images that follow each other
  double cell_px = 0;               // of the squares by which the view is shared out

  /// Wrong matches agree on a motion in a pair here and there, a body does in every fourth at least.
  bool exists() const { return other_pairs > 0 && 4 * other_pairs >= pairs; }
  /// Where one is looked for that turns: two that hardly move against each other show it in few pairs. A
  /// single texture shows it in one of some two hundred, never in three of thirty; a room of repeated ones
  /// may.
  bool may_exist() const { return exists() || (other_pairs >= 3 && 10 * other_pairs >= pairs); }
  /// Of the tracks.
  double share() const;
  /// Of the view: of the squares of the images that show either, those that show the other for the most part.
  /// A screen full of letters has most of the features, and a room about it fills the view.
  double share_of_view() const;
  /// Of the matches: how much of what its images show the map explains.
  double explained() const {
    return matches > 0 ? static_cast<double>(obeying) / static_cast<double>(matches) : 0;
  }
  /// Whoever looks at the images may well have meant it.
  bool is_comparable() const { return exists() && (share() > kComparable || share_of_view() > kMostOfView); }
  /// Of all that moves as one, and by more than what a few wrong matches may have moved to its side.
  bool is_larger() const { return exists() && share() > kLarger; }
  /// Than the map's body: by half as much again, as the measure is good to a tenth or two, and all the time.
  bool rotates_plainly_less() const {
    return map_rotation > kPlainly * other_rotation && other_rotation_alone < kRotatesAlone;
  }

  static constexpr double kPlainly = 1.5, kComparable = 0.25, kLarger = 0.55, kMostOfView = 0.5;
  static constexpr double kRotatesAlone = 0.05;  // nine degrees; right maps of ten recordings: .029 at most
};

/// Of what is seen: the keyframes alone, or the images between them as well.
enum class ComparedImages { kKeyframes, kAllSeen };

/// Keyframes near in time are matched anew by descriptors alone, since a map holds only what agrees with it.
/// A feature that obeys only one of the two motions decides for its whole track. seen: images with all the
/// features of them and the poses that the map gives them, by frame. Those of keyframes take the place of
/// what the map kept of these; those between, where they are asked, show what turns farther from one keyframe
/// to the next than features can be matched, or while the camera made none. The result is the same for any
/// number of threads.
IndependentMotion find_independent_motion(const Map& map, const std::vector<RegisteredImage>& seen,
                                          ComparedImages asked, const MatchOptions& matching,
                                          const RansacOptions& ransac, int threads);

/// Whether there is one: the same of some thirty pairs of keyframes that follow each other, spread over the
/// recording, at a cost that does not grow with the map. camera_goes_through: a place, so that what is fixed
/// to the camera, such as a bonnet or words written into the images, is no body. is_connected: the
/// map, all in one; then what is far and lies behind the cameras says nothing, unless more of it does than
/// noise puts there.
IndependentMotion sample_independent_motion(const Map& map, const MatchOptions& matching,
                                            const RansacOptions& ransac, bool camera_goes_through,
                                            bool is_connected, int threads);

/// How far what obeys the motion turns before the camera between the two images, as in IndependentMotion; 0
/// of fewer than five matches.
double rotation_between(const RegisteredImage& first, const RegisteredImage& second, const PairMotions& pair,
                        ObeyedMotion motion);

/// The angle within which the cameras stand round what the map is of, seen from its middle (rad): how far it
/// has turned before them.
double rotation_before_cameras(const Map& map);

}  // namespace mono_pose_tracker
