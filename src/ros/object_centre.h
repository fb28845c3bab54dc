#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "mono_pose_tracker/io/ply.h"

namespace mono_pose_tracker {

/// Extent of an object in its map (map units).
struct ObjectBox {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double extent = 0;  // of its longest side
};

/// The box that holds 90 % of the points along each axis of the map, which makes it robust against outliers.
/// Unlike the median, its centre hardly moves when one side of the object has more points. Nothing without
/// points.
std::optional<ObjectBox> box_of(const std::vector<ColoredPoint>& points);

/// The centre of an object whose map grows: taken from the first points, then moved as rarely as possible,
/// because users see each move as a jump. Not locked.
class ObjectCentre {
 public:
  /// Stores the points of the newest revision of a map; the centre does not move.
  void see(std::uint32_t epoch, const std::vector<ColoredPoint>& points);
  /// Whether a frame of this map would be published without a centre.
  bool wants_points(std::uint32_t epoch) const;

  /// Applies the stored points of this map if the centre is wrong by more than kMostOff of the extent or
  /// belongs to another map. Returns the displacement of the centre within the same map.
  std::optional<Eigen::Vector3d> follow(std::uint32_t epoch);

  const Eigen::Vector3d& in_map() const { return box_.centre; }
  double extent() const { return box_.extent; }
  std::uint32_t moves(std::uint32_t epoch) const { return epoch_ == epoch ? moves_ : 0; }

  static constexpr double kMostOff = 0.05;  // of the extent: on a head 1 cm

 private:
  std::optional<std::uint32_t> epoch_, seen_epoch_;
  ObjectBox box_, seen_;
  std::uint32_t moves_ = 0;
};

}  // namespace mono_pose_tracker
