#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "mono_pose_tracker/io/ply.h"

namespace mono_pose_tracker {

/// Where an object lies, in its map (map units).
struct ObjectBox {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double extent = 0;  // of its longest side
};

/// The box that holds nine tenths of the points along each axis of the map: a few may be wherever they like.
/// Its middle, unlike the points' median, hardly moves when one side of the object has more of them. Nothing
/// without points.
std::optional<ObjectBox> box_of(const std::vector<ColoredPoint>& points);

/// The centre of an object whose map grows: taken from the first points, then moved as seldom as may be, for
/// each move is a jump to those who use it. Not locked.
class ObjectCentre {
 public:
  /// Points of the newest revision of a map; nothing is moved.
  void see(std::uint32_t epoch, const std::vector<ColoredPoint>& points);
  /// Whether a frame of this map would be given without a centre.
  bool wants_points(std::uint32_t epoch) const;

  /// What was seen of this map comes into force, where the centre is off by more than kMostOff of the extent
  /// or is another map's. Returns by how much a centre of the same map has moved, in the map.
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
