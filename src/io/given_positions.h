#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mono_pose_tracker/io/trajectory.h"

namespace mono_pose_tracker {

/// A point on the WGS 84 ellipsoid: degrees, and metres above it.
struct GeodeticPoint {
  double latitude_deg = 0, longitude_deg = 0, altitude = 0;
};

/// East, north, up (m) of a point in the plane that touches the ellipsoid at the origin's latitude and
/// longitude, at the origin's altitude.
Eigen::Vector3d east_north_up(const GeodeticPoint& origin, const GeodeticPoint& point);

struct NamedPosition {
  std::string name;
  Eigen::Vector3d x_in_world = Eigen::Vector3d::Zero();  // m
};

/// Camera positions that were measured by something else: GNSS, a total station, another tracker. One of the
/// two lists is filled.
struct GivenPositions {
  std::vector<StampedPose> poses;    // by stamp; of TUM lines
  std::vector<NamedPosition> named;  // east, north, up from `origin`, the first line's
  std::optional<GeodeticPoint> origin;
};

/// Reads TUM lines `timestamp tx ty tz qx qy qz qw` or lines `image-name latitude longitude altitude`
/// (degrees, metres; the name may hold spaces); # comments and blank lines are allowed. Throws
/// std::runtime_error, one line that names the file, the line and what was expected.
GivenPositions read_given_positions(const std::string& path);

}  // namespace mono_pose_tracker
