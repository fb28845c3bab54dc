#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "map/frame.h"
#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

/// The first views and points of a map; the first view is the map's frame. Its lengths have a unit that means
/// nothing (one image pair's distance, as a rule): the mapper gives the map its own, of which the median
/// depth of the first view's points is 1, or metres.
struct InitialMap {
  struct View {
    Frame frame;
    Rigid3 camera_from_map;     // in that unit
    std::vector<char> fixed{};  // flags of features that are fixed to the camera; empty: none is known
  };
  struct Point {
    Eigen::Vector3d x_in_map;                       // in that unit
    std::vector<std::pair<int, int>> observations;  // view, feature
  };
  std::vector<View> views;  // by stamp; the newest is the frame that was added last
  std::vector<Point> points;
};

}  // namespace mono_pose_tracker
