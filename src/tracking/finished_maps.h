#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "mono_pose_tracker/tracking/finished_map.h"

namespace mono_pose_tracker {

std::set<std::int64_t> frames_of(const std::vector<PosedFrame>& trajectory);

// Whether it came from a file: frames of earlier runs come before 0.
bool is_loaded(const FinishedMap& map);

// Frames that have a pose, though none in the first map.
std::size_t frames_beside_first(const std::vector<FinishedMap>& maps);

// What was begun while the camera was lost tells nothing more when every frame of it has found its place in
// the first map; what was loaded stays.
void leave_out_covered_maps(std::vector<FinishedMap>* maps);

// A map beside the first of fewer images than these is not confirmed. Why it has nothing in common with the
// first is not known, and so few images hardly contradict each other: of ten to sixteen, maps were 5 to 9 %
// off that all was right about; none of twenty or more.
constexpr std::size_t kLeastBesideFirst = 20;
void doubt_few_images(std::vector<FinishedMap>* maps);

// Of the recording's images that show anything: the share that the first map holds. All of them, where it was
// loaded, since the camera may have gone where that has nothing, or is of an object, which may have turned
// away.
double share_held(const FinishedMap& first, std::int64_t images);

// Where the first map holds less than two thirds of the images, it is told (FinishedMap::holds_little), and
// none is confirmed: what tears a map may have bent it as well. Of parts of a walk along a skyline those that
// were 6 to 8 % off, with nothing in them against it, held a third of the images to nearly two thirds.
void doubt_parts(std::int64_t images, std::vector<FinishedMap>* maps);

}  // namespace mono_pose_tracker
