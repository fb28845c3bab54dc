#pragma once

#include <functional>

namespace mono_pose_tracker {

class Mapper;

/// Work on a snapshot of the map that runs in the background, as its duration grows with the map. It returns
/// a short job for the mapper, and returns early once `cancelled` is true. It does not throw: the returned
/// job throws its errors, so that the mapper knows that the work has ended.
using BackgroundJob = std::function<std::function<void(Mapper&)>(const std::function<bool()>& cancelled)>;

}  // namespace mono_pose_tracker
