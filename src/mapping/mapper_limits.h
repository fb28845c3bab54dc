#pragma once

#include <array>
#include <cstddef>

#include "common/rotation.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// Thresholds of the Mapper and its Atlas and GlobalRefiner in addition to the user's MapperOptions.
struct MapperLimits {
  // A growing map.
  double min_correction = 0.1;  // share by which an alternative's cost must be lower to replace a young map.
                                // Where both are equally wrong the costs differ by less, and the map would
                                // oscillate between them
  std::size_t large_map = 400;  // keyframes; up to this size, testing all landmarks takes less than a tenth
                                // of the time of the window's adjustment
  int motion_partners = 2;      // neighbours whose motions are compared with a new keyframe's, as the two
                                // motions may coincide in one of them
  int covariance_landmarks = 200;  // constrain a pose about as well as all do: their noise shows in the
                                   // frame's own residuals
  int other_views = 4;             // covisible keyframes that are located in another map with the newest one
  std::size_t kept_corrections = 64;  // more than the number of waiting keyframes and delayed images

  // Culling.
  std::size_t removed_keyframes = 1500;  // that a capped map keeps: a keyframe each half second for twelve
                                         // minutes, as long as the tracker keeps the poses of frames at 30
                                         // Hz. Every snapshot has them all
  std::size_t room_made_at_once = 50;    // a capped map loses this fraction at once, as the search for the
                                         // least useful keyframes takes time in proportion to the map
  int redundant_observers = 3;           // other keyframes that observe a landmark for which one is redundant
                                         // (Mur-Artal et al., ORB-SLAM, 2015)
  KeyframeId keyframes_to_confirm = 3;   // two views cannot be inconsistent along the epipolar line. A
                                         // landmark that two keyframes and none of this number of later ones
                                         // observe is more often a wrong match than not
  std::size_t fewest_keyframes = 3;      // two define the map's frame; a third is needed for inconsistencies

  // Unit of the map.
  double marker_parallax = 2 * kDegree;  // rad. Corners are accurate to about 0.3 px: a depth error of 1 to 2
                                         // % at 600 px of focal length
  double max_side_difference = 0.05;   // share of the mean side. The marker is square: a larger deviation is
                                       // due to a wrong corner
  double reported_unit_change = 0.01;  // relative; smaller changes are not published

  // Final adjustments.
  int final_iterations = 50;      // independent of the options: no image waits at the end of a recording
  int rough_landmarks = 200;      // of a keyframe, in adjustments that a final one follows
  double rough_tolerance = 1e-5;  // share of the cost. The first adjustment need not converge, as more
                                  // matches are found and wrong ones culled after it
  double final_tolerance = 1e-7;  // share of the cost, of the adjustment that gives the result

  // Edges of the view graph from each keyframe.
  std::array<std::size_t, 6> earlier = {1, 2, 3, 4, 6, 8};  // distances in time, in keyframes
  int covisible = 4, similar = 3;                           // keyframes
};
inline constexpr MapperLimits kMapperLimits{};

}  // namespace mono_pose_tracker
