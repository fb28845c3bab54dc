#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

#include "map/frame.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// The first views and points of a map. The first view is the map's frame. The unit of length is arbitrary
/// (the baseline of one image pair, as a rule). The mapper rescales it, so that the median distance of the
/// first view's points is 1, or to metres.
struct InitialMap {
  struct View {
    Frame frame;
    Rigid3 camera_from_map;     // in that unit
    std::vector<char> fixed{};  // flags of ego-vehicle features and static overlay; empty: none known
  };
  struct Point {
    Eigen::Vector3d x_in_map;                       // in that unit
    std::vector<std::pair<int, int>> observations;  // view, feature
  };
  std::vector<View> views;  // by stamp; the newest is the frame added last
  std::vector<Point> points;
};

/// A registered frame that is to become a keyframe of a map. Its pose is relative to a keyframe, which may be
/// corrected meanwhile.
struct KeyframeCandidate {
  std::uint32_t map_id = 0;
  Frame frame;
  KeyframeId reference = -1;
  Rigid3 camera_from_reference;
  std::vector<FrameObservation> observations;
  std::uint64_t corrections = 0;  // sequence of the last MapCorrection applied to its ids and lengths
};

}  // namespace mono_pose_tracker
