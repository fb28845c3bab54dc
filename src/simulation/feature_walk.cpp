#include "simulation/feature_walk.h"

#include <algorithm>
#include <cmath>

#include "common/rotation.h"
#include "simulation/camera_path.h"
#include "street_scene.h"

namespace mono_pose_tracker {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFarthest = 25;     // m: what is farther has no features
constexpr double kMinFacing = 0.17;  // cosine: walls seen at more than 80 degrees have none either
constexpr double kStride = 0.5;      // m from one frame to the next
constexpr double kFeatureSize = 12;  // px at 1 m
constexpr double kDensity = 12;      // points a metre of wall

class WalkBuilder {
 public:
  explicit WalkBuilder(std::uint64_t seed) : random_(seed) {}

  void add_wall(const PlanWall& wall, double density) {
    const Vector2d along = (wall.to - wall.from).normalized(), normal(along.y(), -along.x());
    const int count = static_cast<int>(density * (wall.to - wall.from).norm());
    for (int i = 0; i < count; ++i) {
      const Vector2d at = wall.from + random_.uniform(0, 1) * (wall.to - wall.from) +
                          random_.uniform(0, 0.5) * normal;  // things stand out of it
      add_point({at.x(), random_.uniform(-2.5, 1.5), at.y()}, {normal.x(), 0, normal.y()});
    }
  }

  // Copies of a stretch of points on a wall, with one set of descriptors: doors, or whole rooms.
  void add_copies(const PlanWall& wall, double first, double spacing, int copies, double width, int points,
                  std::uint64_t seed) {
    const Vector2d along = (wall.to - wall.from).normalized(), normal(along.y(), -along.x());
    for (int d = 0; d < copies; ++d) {
      Random same(seed);
      for (int i = 0; i < points; ++i) {
        const double place = first + d * spacing + same.uniform(0, width);
        const Vector2d at = wall.from + place * along + same.uniform(0, 0.3) * normal;
        add_point({at.x(), same.uniform(-1.2, 0.9), at.y()}, {normal.x(), 0, normal.y()}, &same);
      }
    }
  }

  void add_plan(const StreetPlan& plan, double density) {
    for (const PlanWall& wall : plan.walls()) add_wall(wall, density);
    for (const PlanBlock& block : plan.blocks) walk_.blocks.push_back({block.low, block.high});
  }

  // The camera looks `aside_deg` to the right of the way, with the sway of a walk.
  FeatureWalk finish(const std::vector<Waypoint>& way, double aside_deg) {
    const Wander3 sway(20, 40, &random_), turn(20, 40, &random_);
    for (std::size_t i = 0; i < way.size(); ++i) {
      const double s = static_cast<double>(i) / 400;  // cycles count per 200 m
      const Vector3d shift = 0.06 * sway(s), glance = 2 * kDegree * turn(s);
      const Vector3d center(way[i].at.x() + shift.x(), shift.y(), way[i].at.y() + shift.z());
      const Eigen::Quaterniond world_from_camera =
          Eigen::AngleAxisd(way[i].heading + aside_deg * kDegree + glance.y(), Vector3d::UnitY()) *
          Eigen::AngleAxisd(glance.x(), Vector3d::UnitX()) * Eigen::AngleAxisd(glance.z(), Vector3d::UnitZ());
      walk_.camera_from_world.push_back(Rigid3(world_from_camera, center).inverse());
    }
    walk_.length = length_of(way);
    walk_.descriptors = cv::Mat(static_cast<int>(walk_.x_in_world.size()), 128, CV_8U, bytes_.data()).clone();
    return std::move(walk_);
  }

 private:
  // Two random descriptors are about as far apart as unrelated patches are (unit length is stored as 512).
  void add_point(const Vector3d& x, const Vector3d& normal, Random* descriptor = nullptr) {
    walk_.x_in_world.push_back(x);
    walk_.normal_in_world.push_back(normal);
    for (int k = 0; k < 128; ++k) {
      bytes_.push_back(static_cast<std::uint8_t>((descriptor ? *descriptor : random_).index(80)));
    }
  }

  Random random_;
  FeatureWalk walk_;
  std::vector<std::uint8_t> bytes_;
};

// Whether the way from a to b (x, z) crosses the block, a hand's breadth inside its walls.
bool hides(const WalkBlock& block, const Vector2d& a, const Vector2d& b) {
  double enter = 0, leave = 1;
  for (int axis = 0; axis < 2; ++axis) {
    const double low = block.low[axis] + 0.1, high = block.high[axis] - 0.1, step = b[axis] - a[axis];
    if (std::abs(step) < 1e-12) {
      if (a[axis] < low || a[axis] > high) return false;
      continue;
    }
    const double first = (low - a[axis]) / step, second = (high - a[axis]) / step;
    enter = std::max(enter, std::min(first, second));
    leave = std::min(leave, std::max(first, second));
  }
  return enter < leave;
}

bool is_seen(const FeatureWalk& walk, int point, const Vector3d& center) {
  const Vector3d ray = walk.x_in_world[point] - center;
  const double distance = ray.norm();
  if (distance > kFarthest || -ray.dot(walk.normal_in_world[point]) < kMinFacing * distance) return false;
  const Vector2d from(center.x(), center.z());
  const Vector2d to(walk.x_in_world[point].x(), walk.x_in_world[point].z());
  return std::none_of(walk.blocks.begin(), walk.blocks.end(),
                      [&](const WalkBlock& block) { return hides(block, from, to); });
}

}  // namespace

FeatureWalk block_walk(std::uint64_t seed, double overlap) {
  const StreetPlan plan = block_plan(overlap);
  WalkBuilder builder(seed);
  builder.add_plan(plan, kDensity);
  return builder.finish(rounded_way(plan, kStride), plan.aside_deg);
}

FeatureWalk figure_eight_walk(std::uint64_t seed) {
  const StreetPlan plan = figure_eight_plan();
  WalkBuilder builder(seed);
  builder.add_plan(plan, kDensity);
  return builder.finish(rounded_way(plan, kStride), plan.aside_deg);
}

FeatureWalk corridor_walk(std::uint64_t seed) {
  constexpr double kOwn = 12;  // points a metre: scratches and notices
  constexpr double kDoorWidth = 1.2;
  constexpr int kPointsOfDoor = 60;
  const StreetPlan plan = corridor_plan();
  WalkBuilder builder(seed);
  builder.add_plan(plan, kOwn);
  // The wall at its end, which the turn is made before.
  constexpr double kOwnAtEnd = 60;
  builder.add_wall(plan.surroundings[1], kOwnAtEnd);
  for (const PlanWall& wall : plan.door_walls) {
    const int doors = static_cast<int>((wall.to - wall.from).norm() / plan.door_spacing);
    builder.add_copies(wall, 0.5, plan.door_spacing, doors, kDoorWidth, kPointsOfDoor, seed * 7919 + 1);
  }
  return builder.finish(rounded_way(plan, 0.5 * kStride), plan.aside_deg);
}

FeatureWalk repetitive_corridor_walk(std::uint64_t seed) {
  constexpr double kWall = 4;  // m from the way
  const PlanWall wall{{-kWall, -8}, {-kWall, 60}};
  WalkBuilder builder(seed);
  builder.add_wall({{-kWall, 16}, {-kWall, 28}}, kDensity);
  builder.add_wall({{-kWall, 44}, {-kWall, 60}}, kDensity);
  builder.add_copies(wall, 0, 28, 2, 24, 400, seed * 7919 + 1);
  StreetPlan plan;
  plan.corners = {{0, 0}, {0, 44}};
  return builder.finish(rounded_way(plan, kStride), -80);
}

FeatureWalk ring_walk(std::uint64_t seed) {
  constexpr double kRadius = 3.5, kStepDeg = 7.5;
  WalkBuilder builder(seed);
  StreetPlan hall;
  hall.surroundings = {{{-8, -8}, {-8, 8}}, {{-8, 8}, {8, 8}}, {{8, 8}, {8, -8}}, {{8, -8}, {-8, -8}}};
  builder.add_plan(hall, 2 * kDensity);
  std::vector<Waypoint> way;
  for (int step = 0; step * kStepDeg < 430; ++step) {
    const double angle = step * kStepDeg;
    way.push_back(
        {kRadius * Vector2d(std::sin(angle * kDegree), std::cos(angle * kDegree)), (angle + 90) * kDegree});
  }
  return builder.finish(way, -60);
}

FeatureWalk street_walk(std::uint64_t seed, int frames) {
  constexpr double kWall = 6;  // m from the way
  const double end = kStride * frames;
  WalkBuilder builder(seed);
  builder.add_wall({{-kWall, -kFarthest}, {-kWall, end + kFarthest}}, 5 * kDensity);
  std::vector<Waypoint> way;
  for (int i = 0; i < frames; ++i) way.push_back({{0, kStride * i}, 0});
  return builder.finish(way, -70);
}

FeatureWalk wall_walk(std::uint64_t seed, int frames) {
  constexpr double kWall = 6, kSway = 1.5, kLapFrames = 100;  // m, m, frames
  WalkBuilder builder(seed);
  builder.add_wall({{-kWall, -8}, {-kWall, 8}}, 5 * kDensity);
  std::vector<Waypoint> way;
  for (int i = 0; i < frames; ++i) {
    // From one frame to the next at least as far as two views of a map need; never the same place again.
    const double phase = 2 * M_PI * i / kLapFrames;
    way.push_back({{0.3 * kSway * std::sin(1.618 * phase), kSway * std::sin(phase)}, 0});
  }
  return builder.finish(way, -90);
}

CameraModel walk_camera() {
  CameraParameters parameters;
  parameters.width = 640;
  parameters.height = 480;
  parameters.fx = parameters.fy = 500;
  parameters.cx = 319.5;
  parameters.cy = 239.5;
  return CameraModel(parameters);
}

Frame walk_frame(const FeatureWalk& walk, const CameraModel& camera, int index, double noise_px,
                 Random& random, std::vector<int>* point_of) {
  const Rigid3& camera_from_world = walk.camera_from_world.at(index);
  const Vector3d center = camera_from_world.inverse().translation;
  FeatureSet set;
  for (int i = 0; i < static_cast<int>(walk.x_in_world.size()); ++i) {
    const Vector3d x_in_camera = camera_from_world * walk.x_in_world[i];
    Vector2d pixel;
    if (x_in_camera.z() < 0.3 || !camera.project(x_in_camera, &pixel)) continue;
    if (!camera.in_image(pixel) || !is_seen(walk, i, center)) continue;
    pixel += noise_px * Vector2d(random.normal(), random.normal());
    if (!camera.in_image(pixel)) continue;
    Feature feature;
    feature.pixel = pixel.cast<float>();
    feature.scale = static_cast<float>(std::max(1.0, kFeatureSize / x_in_camera.norm()));
    feature.response = 1;
    set.features.push_back(feature);
    set.descriptors.push_back(walk.descriptors.row(i));
    if (point_of) point_of->push_back(i);
  }
  const cv::Mat image(camera.height(), camera.width(), CV_8UC1, cv::Scalar(128));
  return {index, index * std::int64_t{100000000}, make_image_features(std::move(set), image, camera)};
}

Frame walk_frame(const FeatureWalk& walk, const CameraModel& camera, int index, double noise_px,
                 Random& random) {
  return walk_frame(walk, camera, index, noise_px, random, nullptr);
}

}  // namespace mono_pose_tracker
