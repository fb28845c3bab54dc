#pragma once

#include <cstdint>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "simulation/panel_scene.h"
#include "street_plan.h"

namespace mono_pose_tracker {

// The plan built of panels, z up: houses of 8 m with a front each, a street or floor, doors.
PanelScene make_street_scene(const StreetPlan& plan, std::uint32_t seed);

// map_from_camera of each frame of the plan's way, at eye level, with the sway of a walk. frames 0: one every
// 0.25 m, else they are spread over all of the way.
std::vector<Rigid3> street_path(const StreetPlan& plan, int frames, std::uint64_t seed);

}  // namespace mono_pose_tracker
