#include "alignment.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "common/rotation.h"
#include "common/statistics.h"
#include "common/text.h"
#include "geometry/nearest_rotation.h"
#include "io/stamp.h"

namespace mono_pose_tracker {

namespace {

/// A given position and the camera of the map at that moment.
struct GivenFrame {
  std::int64_t index = 0;  // of the nearest frame
  Rigid3 map_from_camera;
  Eigen::Vector3d x_in_world;
  std::optional<Eigen::Quaterniond> world_from_given;
};

Rigid3 moved_pose(const Sim3& world_from_map, const Rigid3& map_from_camera) {
  return {(world_from_map.rotation * map_from_camera.rotation).normalized(),
          world_from_map * map_from_camera.translation};
}

/// The camera at that time: of the nearest frame, or between two successive ones.
std::optional<GivenFrame> camera_at(const std::vector<RegisteredFrame>& by_stamp, const StampedPose& given,
                                    std::int64_t max_difference_ns) {
  const auto after = std::lower_bound(
      by_stamp.begin(), by_stamp.end(), given.stamp_ns,
      [](const RegisteredFrame& frame, std::int64_t stamp_ns) { return frame.stamp_ns < stamp_ns; });
  const RegisteredFrame* const b = after == by_stamp.end() ? nullptr : &*after;
  const RegisteredFrame* const a = after == by_stamp.begin() ? nullptr : &*(after - 1);
  const auto far = [&](const RegisteredFrame* frame) {
    return frame ? std::abs(frame->stamp_ns - given.stamp_ns) : std::numeric_limits<std::int64_t>::max();
  };
  const RegisteredFrame* const nearest = far(a) < far(b) ? a : b;
  if (!nearest) return std::nullopt;
  GivenFrame result;
  result.index = nearest->index;
  result.map_from_camera = nearest->map_from_camera;
  result.x_in_world = given.map_from_camera.translation;
  result.world_from_given = given.map_from_camera.rotation;
  if (far(nearest) <= max_difference_ns) return result;
  if (!a || !b || b->index != a->index + 1) return std::nullopt;
  const double t = static_cast<double>(far(a)) / static_cast<double>(b->stamp_ns - a->stamp_ns);
  result.map_from_camera =
      Rigid3(a->map_from_camera.rotation.slerp(t, b->map_from_camera.rotation),
             (1 - t) * a->map_from_camera.translation + t * b->map_from_camera.translation);
  return result;
}

std::vector<GivenFrame> frames_by_stamp(const std::vector<StampedPose>& given,
                                        std::vector<RegisteredFrame> trajectory,
                                        std::int64_t max_difference_ns) {
  std::stable_sort(
      trajectory.begin(), trajectory.end(),
      [](const RegisteredFrame& a, const RegisteredFrame& b) { return a.stamp_ns < b.stamp_ns; });
  std::vector<GivenFrame> frames;
  for (const StampedPose& pose : given) {
    if (const auto frame = camera_at(trajectory, pose, max_difference_ns)) frames.push_back(*frame);
  }
  return frames;
}

std::string file_name_of(const std::string& name) { return std::filesystem::path(name).filename().string(); }

std::vector<GivenFrame> frames_by_name(const std::vector<NamedPosition>& given,
                                       const std::vector<RegisteredFrame>& trajectory,
                                       const std::map<std::int64_t, std::string>& names) {
  // By the whole name, or by that without its folders where it is the only one.
  std::map<std::string, const NamedPosition*> by_name, by_file_name;
  for (const NamedPosition& position : given) by_name[position.name] = &position;
  for (const NamedPosition& position : given) {
    const auto [entry, is_new] = by_file_name.emplace(file_name_of(position.name), &position);
    if (!is_new) entry->second = nullptr;
  }
  std::vector<GivenFrame> frames;
  for (const RegisteredFrame& frame : trajectory) {
    const std::string& name = names.at(frame.index);
    const auto whole = by_name.find(name), last = by_file_name.find(file_name_of(name));
    const NamedPosition* found = whole != by_name.end() ? whole->second : nullptr;
    // One of the two has no folder: names in different folders are different.
    if (!found && last != by_file_name.end() && last->second &&
        (last->first == name || last->first == last->second->name)) {
      found = last->second;
    }
    if (found) frames.push_back({frame.index, frame.map_from_camera, found->x_in_world, std::nullopt});
  }
  return frames;
}

/// What the file names, and what the recording: these have nothing in common.
std::string why_none_belongs(const GivenPositions& given, const FinishedMap& map,
                             const std::map<std::int64_t, std::string>& names) {
  const std::string problem = "no given position belongs to a registered image: the file begins with ";
  if (map.trajectory.empty()) return problem + "others";
  const RegisteredFrame& first = map.trajectory.front();
  if (given.origin) {
    return problem + "the image name " + one_line(given.named.front().name) + ", the path with " +
           one_line(names.at(first.index));
  }
  return problem + "the time stamp " + format_stamp(given.poses.front().stamp_ns) + ", the path with " +
         format_stamp(first.stamp_ns);
}

/// The axes of the map as the orientations of TUM lines have them in the world; none where these are not the
/// camera's.
std::vector<DirectionPair> directions_of_poses(const std::vector<GivenFrame>& frames,
                                               double max_orientation_deg) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const GivenFrame& frame : frames) {
    sum += (*frame.world_from_given * frame.map_from_camera.rotation.conjugate()).toRotationMatrix();
  }
  const Eigen::Quaterniond world_from_map(nearest_rotation(sum));
  std::vector<double> angles;
  for (const GivenFrame& frame : frames) {
    const Eigen::Quaterniond expected = world_from_map * frame.map_from_camera.rotation;
    angles.push_back(expected.angularDistance(*frame.world_from_given) / kDegree);
  }
  if (angles.empty() || median(angles) > max_orientation_deg) return {};
  std::vector<DirectionPair> directions;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d in_map = Eigen::Vector3d::Unit(axis);
    directions.push_back({in_map, world_from_map * in_map});
  }
  return directions;
}

template <typename Frames>
Eigen::Vector3d mean_down(const Frames& frames) {
  Eigen::Vector3d down = Eigen::Vector3d::Zero();
  for (const auto& frame : frames) down += frame.map_from_camera.rotation * Eigen::Vector3d::UnitY();
  return down.norm() > 0 ? down.normalized() : Eigen::Vector3d::UnitY();
}

std::shared_ptr<const MapSnapshot> moved_snapshot(const MapSnapshot& snapshot, const Sim3& world_from_map) {
  auto moved = std::make_shared<MapSnapshot>(snapshot);
  for (ColoredPoint& point : moved->points) {
    point.x_in_map = (world_from_map * point.x_in_map.cast<double>()).cast<float>();
  }
  for (KeyframePose& pose : moved->keyframes) {
    pose.map_from_camera = moved_pose(world_from_map, pose.map_from_camera);
  }
  return moved;
}

void move_map(const Sim3& world_from_map, FinishedMap* map) {
  map->map.transform(world_from_map);
  map->map.set_scale_source(ScaleSource::kKnownBaseline);
  if (map->snapshot) map->snapshot = moved_snapshot(*map->snapshot, world_from_map);
  for (RegisteredFrame& frame : map->trajectory) {
    frame.map_from_camera = moved_pose(world_from_map, frame.map_from_camera);
  }
}

Json residuals_of(const PositionAlignment& alignment, const std::vector<GivenFrame>& frames,
                  const std::map<std::int64_t, std::string>& names) {
  Json residuals = Json::array();
  for (std::size_t i = 0; i < alignment.errors.size(); ++i) {
    residuals.push_back({{"image", names.at(frames[i].index)},
                         {"residual", alignment.errors[i]},
                         {"inlier", alignment.inliers[i] != 0}});
  }
  return residuals;
}

Json summary_of(const PositionAlignment& alignment, const std::vector<GivenFrame>& frames,
                const std::map<std::int64_t, std::string>& names) {
  Json json = {
      {"aligned", alignment.success}, {"positions", frames.size()}, {"inliers", alignment.num_inliers}};
  if (!alignment.success) {
    json["problem"] = alignment.problem;
    return json;
  }
  const Sim3& s = alignment.world_from_map;
  json["scale"] = s.scale;
  json["rotation_xyzw"] = {s.rotation.x(), s.rotation.y(), s.rotation.z(), s.rotation.w()};
  json["translation"] = {s.translation.x(), s.translation.y(), s.translation.z()};
  json["residual_rms"] = alignment.inlier_rms;
  json["residual_median"] = median(alignment.errors);
  json["residual_max"] = *std::max_element(alignment.errors.begin(), alignment.errors.end());
  json["scale_sigma"] = alignment.scale_sigma;
  json["rotation_sigma_deg"] =
      std::isfinite(alignment.rotation_sigma_deg) ? Json(alignment.rotation_sigma_deg) : Json();
  json["rotation_by_orientation"] = alignment.used_directions;
  json["residuals"] = residuals_of(alignment, frames, names);
  return json;
}

std::string name_of_map(std::size_t number) {
  return number == 0 ? "the map" : "map " + std::to_string(number + 1);
}

void warn_of_alignment(const PositionAlignment& alignment, const AlignmentOptions& options,
                       std::size_t number, const FinishedMap& map, std::vector<std::string>* warnings) {
  const std::string name = name_of_map(number);
  const std::size_t outliers = alignment.errors.size() - static_cast<std::size_t>(alignment.num_inliers);
  if (alignment.success && static_cast<double>(outliers) >
                               options.max_outlier_share * static_cast<double>(alignment.errors.size())) {
    warnings->push_back(
        formatted("--align: %zu of %zu given positions do not fit the path of %s (the largest "
                  "residual is %.3g m): check their order, unit and names; report.json lists them",
                  outliers, alignment.errors.size(), name.c_str(),
                  *std::max_element(alignment.errors.begin(), alignment.errors.end())));
  }
  if (!alignment.success) {
    warnings->push_back("--align: " + name + " stays in its own frame and unit: " + alignment.problem);
    return;
  }
  if (alignment.rotation_sigma_deg > options.positions.max_rotation_sigma_deg && !alignment.used_directions) {
    warnings->push_back(
        formatted("--align: the positions lie near one line; the rotation of %s about it is accurate to %.0f "
                  "deg only: give positions of a path with turns, or orientations of the camera",
                  name.c_str(), std::min(alignment.rotation_sigma_deg, 180.0)));
  }
  double largest = 0;
  for (const RegisteredFrame& frame : map.trajectory) {
    largest = std::max(largest, frame.map_from_camera.translation.lpNorm<Eigen::Infinity>());
  }
  if (largest > options.max_coordinate) {
    warnings->push_back(formatted(
        "--align: coordinates reach %.0f m, too large for the 32-bit numbers of points.ply: subtract an "
        "offset from the given positions",
        largest));
  }
}

PositionAlignment align_map(const std::vector<GivenFrame>& frames, bool is_upright,
                            const AlignmentOptions& options) {
  std::vector<PositionPair> pairs;
  for (const GivenFrame& frame : frames) {
    pairs.push_back({frame.map_from_camera.translation, frame.x_in_world});
  }
  PositionAlignmentOptions positions = options.positions;
  std::vector<DirectionPair> directions;
  if (is_upright) {
    positions.max_direction_angle_deg = options.max_pitch_deg;
    directions.push_back({mean_down(frames), -Eigen::Vector3d::UnitZ()});
  } else {
    directions = directions_of_poses(frames, options.max_orientation_deg);
  }
  return align_positions(pairs, directions, positions);
}

}  // namespace

AlignedResult align_to_positions(const GivenPositions& given, const AlignmentOptions& options,
                                 RecordingResult* result, PosesByMap* live) {
  AlignedResult aligned;
  Json maps = Json::array();
  for (std::size_t i = 0; i < result->maps.size(); ++i) {
    FinishedMap& map = result->maps[i];
    const std::vector<GivenFrame> frames =
        given.origin ? frames_by_name(given.named, map.trajectory, result->names)
                     : frames_by_stamp(given.poses, map.trajectory, options.max_difference_ns);
    PositionAlignment alignment = align_map(frames, given.origin.has_value(), options);
    if (frames.empty()) alignment.problem = why_none_belongs(given, map, result->names);
    maps.push_back(summary_of(alignment, frames, result->names));
    if (alignment.success) {
      move_map(alignment.world_from_map, &map);
      aligned.world_from_map[map.id] = alignment.world_from_map;
    }
    warn_of_alignment(alignment, options, i, map, &result->warnings);
  }
  if (!result->maps.empty()) result->trajectory = result->maps.front().trajectory;
  std::size_t left = 0;
  for (auto& [id, poses] : *live) {
    const auto found = aligned.world_from_map.find(id);
    if (found == aligned.world_from_map.end()) left += poses.size();
    if (found == aligned.world_from_map.end()) continue;
    for (StampedPose& pose : poses) pose.map_from_camera = moved_pose(found->second, pose.map_from_camera);
  }
  if (left > 0 && !aligned.world_from_map.empty()) {
    result->warnings.push_back("--align: " + std::to_string(left) +
                               " poses of trajectory_live.txt are of maps that no longer exist; they stay in "
                               "map units");
  }
  aligned.report = {{"frame", given.origin ? "EAST_NORTH_UP" : "GIVEN"}};
  if (given.origin) {
    aligned.report["origin"] = {{"latitude_deg", given.origin->latitude_deg},
                                {"longitude_deg", given.origin->longitude_deg},
                                {"altitude", given.origin->altitude}};
  }
  aligned.report["maps"] = std::move(maps);
  return aligned;
}

void move_as_aligned(const RecordingResult& result, const AlignedResult& aligned, SavedMaps* saved) {
  for (const FinishedMap& finished : result.maps) {
    const auto found = aligned.world_from_map.find(finished.id);
    if (found == aligned.world_from_map.end() || finished.map.keyframes().empty()) continue;
    const std::int64_t frame = finished.map.keyframes().begin()->second.frame_index;
    for (Map& map : saved->maps) {
      const bool is_it = std::any_of(map.keyframes().begin(), map.keyframes().end(),
                                     [&](const auto& entry) { return entry.second.frame_index == frame; });
      if (!is_it) continue;
      map.transform(found->second);
      map.set_scale_source(ScaleSource::kKnownBaseline);
    }
  }
}

Eigen::Quaterniond view_from_map(const std::vector<RegisteredFrame>& trajectory) {
  const Eigen::Vector3d mean = mean_down(trajectory);
  int axis = 0;
  mean.cwiseAbs().maxCoeff(&axis);
  Eigen::Matrix3d rows;
  rows.row(1) = (mean[axis] < 0 ? -1 : 1) * Eigen::RowVector3d::Unit(axis);
  rows.row(2) = Eigen::RowVector3d::Unit(axis == 2 ? 1 : 2);
  rows.row(0) = rows.row(1).cross(rows.row(2));
  return Eigen::Quaterniond(rows);
}

}  // namespace mono_pose_tracker
