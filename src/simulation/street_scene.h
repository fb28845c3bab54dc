#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "simulation/panel_scene.h"

namespace mono_pose_tracker {

// What stands along a long walk and how it goes, seen from above: x to the right, y up the page, m.

struct PlanWall {
  Eigen::Vector2d from, to;  // seen from the right of this direction only
};

struct PlanBlock {
  Eigen::Vector2d low, high;
};

struct Waypoint {
  Eigen::Vector2d at;
  double heading = 0;  // of the way, rad, from y towards x
};

struct StreetPlan {
  std::vector<PlanBlock> blocks;         // with a wall on each side, which hide what is behind them
  std::vector<PlanWall> surroundings;    // the other side of the streets
  std::vector<PlanWall> door_walls;      // with identical doors
  double door_spacing = 3;               // m
  std::vector<Eigen::Vector2d> corners;  // of the way
  double corner_radius = 4;              // m
  double aside_deg = 0;                  // where the camera looks: so far to the right of the way

  std::vector<PlanWall> walls() const;  // of the blocks, then the surroundings
};

// Round a block of houses, 200 m, and its first `overlap` metres once more.
StreetPlan block_plan(double overlap);
// A street, round the block to its left, the street again, round the block to its right, the street's
// beginning.
StreetPlan figure_eight_plan();
// Up a corridor of 60 m, looking at one wall, and back, looking at the other.
StreetPlan corridor_plan();

// Along the corners, rounded, from the first to the last, a waypoint every `step` metres.
std::vector<Waypoint> rounded_way(const StreetPlan& plan, double step);
double length_of(const std::vector<Waypoint>& way);

// The plan built of panels, z up: houses of 8 m with a front each, a street or floor, doors.
PanelScene make_street_scene(const StreetPlan& plan, std::uint32_t seed);

// map_from_camera of each frame of the plan's way, at eye level, with the sway of a walk. frames 0: one every
// 0.25 m, else they are spread over all of the way.
std::vector<Rigid3> street_path(const StreetPlan& plan, int frames, std::uint64_t seed);

}  // namespace mono_pose_tracker
