#pragma once

#include <functional>

namespace mono_pose_tracker {

class Mapper;

/// Work on a snapshot that takes as long as the map is large, done beside the mapper's own; what it returns
/// is then done by the mapper, and is little. It is to return soon once `cancelled` says so.
using Aside = std::function<std::function<void(Mapper&)>(const std::function<bool()>& cancelled)>;

}  // namespace mono_pose_tracker
