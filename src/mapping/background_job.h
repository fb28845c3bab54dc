#pragma once

#include <functional>

namespace mono_pose_tracker {

class Mapper;

/// Work on a snapshot that takes the longer the larger the map is, done beside the mapper's own. It returns
/// the little that the mapper is then to do, and returns soon once `cancelled` says so. It does not throw:
/// what goes wrong, the mapper is to throw, so that it knows that the work has ended.
using BackgroundJob = std::function<std::function<void(Mapper&)>(const std::function<bool()>& cancelled)>;

}  // namespace mono_pose_tracker
