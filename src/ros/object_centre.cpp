#include "ros/object_centre.h"

#include <algorithm>

namespace mono_pose_tracker {
namespace {

// On either side, of the points: more than that are rarely wrong.
constexpr double kExcludedShare = 0.05;

}  // namespace

std::optional<ObjectBox> box_of(const std::vector<ColoredPoint>& points) {
  if (points.empty()) return std::nullopt;
  ObjectBox box;
  std::vector<float> values(points.size());
  const auto excluded = static_cast<std::ptrdiff_t>(kExcludedShare * static_cast<double>(points.size()));
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(points.begin(), points.end(), values.begin(),
                   [axis](const ColoredPoint& point) { return point.x_in_map[axis]; });
    const auto at = [&values](std::ptrdiff_t rank) -> double {
      std::nth_element(values.begin(), values.begin() + rank, values.end());
      return values[static_cast<std::size_t>(rank)];
    };
    const double low = at(excluded), high = at(static_cast<std::ptrdiff_t>(values.size()) - 1 - excluded);
    box.centre[axis] = 0.5 * (low + high);
    box.extent = std::max(box.extent, high - low);
  }
  return box;
}

void ObjectCentre::see(std::uint32_t epoch, const std::vector<ColoredPoint>& points) {
  if (seen_epoch_ && epoch < *seen_epoch_) return;  // somebody has seen the next map meanwhile
  const std::optional<ObjectBox> box = box_of(points);
  if (!box) return;
  seen_epoch_ = epoch;
  seen_ = *box;
}

bool ObjectCentre::wants_points(std::uint32_t epoch) const { return epoch_ != epoch && seen_epoch_ != epoch; }

std::optional<Eigen::Vector3d> ObjectCentre::follow(std::uint32_t epoch) {
  if (seen_epoch_ != epoch) return std::nullopt;
  const bool is_new = epoch_ != epoch;
  const Eigen::Vector3d off = seen_.centre - box_.centre;
  if (!is_new && off.norm() <= kMostOff * seen_.extent) return std::nullopt;
  epoch_ = epoch;
  box_ = seen_;
  moves_ = is_new ? 0 : moves_ + 1;
  if (is_new) return std::nullopt;
  return off;
}

}  // namespace mono_pose_tracker
