#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/io/ply.h"

namespace mono_pose_tracker {

/// An image of a recording as the page shows it.
struct SceneImage {
  enum class State { kRegistered = 0, kUncertain = 1, kNotRegistered = 2 };

  std::string name;
  std::optional<double> time;  // s
  std::optional<Rigid3> map_from_camera;
  State state = State::kRegistered;
  bool is_keyframe = false;
  int inliers = -1;                     // -1: not known
  std::optional<double> error;          // distance to a reference, in the page's unit
  std::vector<std::string> notes;       // what was found about it
  std::vector<std::uint8_t> thumbnail;  // JPEG; may be empty
};

/// A map and its cameras, to look at in a browser. Images are in the recording's order; an image without a
/// pose breaks the path.
struct ScenePage {
  std::string title;
  std::string unit = "map units";
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();      // in the map, any length
  double tan_half_width = 0.5, tan_half_height = 0.4;  // of the view's angle: the shape of the frusta
  std::vector<ColoredPoint> points;
  std::vector<SceneImage> images;
  std::vector<std::pair<std::int64_t, std::int64_t>> loops;  // of images
  std::vector<std::string> findings;                         // about all of it
  std::vector<Eigen::Vector3d> reference;                    // a second path; may be empty
  double worst_error = 0;                                    // 0: paths are coloured by time, else by error
};

struct ScenePageOptions {
  /// Of more points an evenly spread selection is written. 200,000 take 4 MB.
  std::size_t max_points = 200000;
  /// Of larger thumbnails together, every second, third, ... image keeps its own. 6.5 MB take 8.7 MB as text.
  std::size_t max_thumbnail_bytes = 6500000;
};

/// Writes one HTML file that needs nothing else: no request leaves it. Throws std::runtime_error naming the
/// path when it cannot be written.
void write_scene_page(const std::string& path, const ScenePage& page, const ScenePageOptions& options = {});

}  // namespace mono_pose_tracker
