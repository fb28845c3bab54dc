#include "street_scene.h"

#include <algorithm>
#include <cmath>

#include "common/rotation.h"
#include "common/statistics.h"
#include "simulation/camera_path.h"

namespace mono_pose_tracker {
namespace {

using Eigen::Vector2d;

// From one waypoint to the next: who walks round a tight corner takes more pictures there.
constexpr double kMaxTurn = 8 * kDegree;

// The four walls of a rectangle, seen from inside; from outside when the ends of each change places.
std::vector<PlanWall> walls_inwards(const Vector2d& low, const Vector2d& high) {
  const Vector2d left_top(low.x(), high.y()), right_bottom(high.x(), low.y());
  return {{low, left_top}, {left_top, high}, {high, right_bottom}, {right_bottom, low}};
}

}  // namespace

std::vector<PlanWall> StreetPlan::walls() const {
  std::vector<PlanWall> result;
  for (const PlanBlock& block : blocks) {
    for (const PlanWall& wall : walls_inwards(block.low, block.high)) result.push_back({wall.to, wall.from});
  }
  result.insert(result.end(), surroundings.begin(), surroundings.end());
  return result;
}

StreetPlan block_plan(double overlap) {
  StreetPlan plan;
  plan.blocks = {{{4, 4}, {58, 38}}};
  plan.surroundings = walls_inwards({-4, -4}, {66, 46});
  plan.corners = {{0, 20}, {0, 42}, {62, 42}, {62, 0}, {0, 0}, {0, 20 + overlap}};
  plan.aside_deg = 30;
  return plan;
}

StreetPlan figure_eight_plan() {
  StreetPlan plan;
  plan.blocks = {{{-24, 4}, {-4, 24}}, {{4, 4}, {24, 24}}};
  plan.surroundings = walls_inwards({-32, -4}, {32, 32});
  plan.corners = {{0, 6}, {0, 28}, {-28, 28}, {-28, 0}, {0, 0}, {0, 28}, {28, 28}, {28, 0}, {0, 0}, {0, 18}};
  return plan;
}

StreetPlan corridor_plan() {
  constexpr double kLength = 60;
  StreetPlan plan;
  plan.surroundings = walls_inwards({-1.5, 0}, {1.5, kLength});
  plan.door_walls = {plan.surroundings[0], plan.surroundings[2]};
  plan.corners = {{-0.6, 1}, {-0.6, kLength - 4}, {0.6, kLength - 4}, {0.6, 1}};
  plan.corner_radius = 0.6;
  plan.aside_deg = -40;
  return plan;
}

std::vector<Waypoint> rounded_way(const StreetPlan& plan, double step) {
  std::vector<Vector2d> fine;
  const std::vector<Vector2d>& corners = plan.corners;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (i == 0 || i + 1 == corners.size()) {
      fine.push_back(corners[i]);
      continue;
    }
    const Vector2d begin = corners[i] - plan.corner_radius * (corners[i] - corners[i - 1]).normalized();
    const Vector2d end = corners[i] + plan.corner_radius * (corners[i + 1] - corners[i]).normalized();
    // A quadratic Bezier curve: as good as an arc for a walk.
    constexpr int kPieces = 20;
    for (int k = 0; k <= kPieces; ++k) {
      const double s = static_cast<double>(k) / kPieces;
      fine.push_back((1 - s) * (1 - s) * begin + 2 * s * (1 - s) * corners[i] + s * s * end);
    }
  }
  std::vector<Waypoint> way;
  double next = 0;  // m from fine[i] on
  for (std::size_t i = 0; i + 1 < fine.size(); ++i) {
    const Vector2d along = fine[i + 1] - fine[i];
    const double length = along.norm(), heading = std::atan2(along.x(), along.y());
    if (length == 0) continue;
    if (!way.empty() && std::abs(std::remainder(heading - way.back().heading, 2 * kPi)) > kMaxTurn) next = 0;
    while (next < length) {
      way.push_back({fine[i] + next / length * along, heading});
      next += step;
    }
    next -= length;
  }
  return way;
}

double length_of(const std::vector<Waypoint>& way) {
  double length = 0;
  for (std::size_t i = 1; i < way.size(); ++i) length += (way[i].at - way[i - 1].at).norm();
  return length;
}

namespace {

using Eigen::Vector3d;

constexpr double kEyeLevel = 1.6;  // m
constexpr double kStep = 0.25;     // m from one frame to the next
constexpr double kHouse = 8;       // m, width of a front

enum StreetStyle { kFront, kGround, kPlaster, kDoor, kStreetStyles };

std::vector<LeafStyle> street_styles() {
  std::vector<LeafStyle> styles(kStreetStyles);
  const std::vector<Color> bright = {{0.70f, 0.30f, 0.22f}, {0.24f, 0.34f, 0.46f}, {0.84f, 0.72f, 0.44f},
                                     {0.18f, 0.18f, 0.20f}, {0.34f, 0.46f, 0.34f}, {0.90f, 0.88f, 0.82f}};
  styles[kFront] = leaf_style({0.66f, 0.60f, 0.52f}, bright, 1.2f, 0.03f, 0.9f);
  styles[kFront].upright = true;
  styles[kGround] =
      leaf_style({0.40f, 0.39f, 0.38f}, {{0.50f, 0.49f, 0.47f}, {0.28f, 0.28f, 0.29f}}, 0.5f, 0.03f, 0.7f);
  // Weak: what tells one stretch of a corridor from another is little.
  styles[kPlaster] =
      leaf_style({0.74f, 0.73f, 0.70f}, {{0.68f, 0.67f, 0.63f}, {0.79f, 0.78f, 0.75f}}, 0.4f, 0.02f, 0.6f);
  styles[kDoor] = leaf_style({0.52f, 0.38f, 0.26f}, bright, 0.3f, 0.02f, 0.9f);
  styles[kDoor].upright = true;
  return styles;
}

class StreetBuilder {
 public:
  explicit StreetBuilder(std::uint32_t seed) : random_(seed) {}

  // Seen from the right of from -> to.
  void add_wall(const PlanWall& wall, double first, double width, double low, double high, int style,
                double before, std::uint32_t seed) {
    const Vector2d along = (wall.to - wall.from).normalized();
    const Vector2d corner = wall.from + first * along + before * Vector2d(along.y(), -along.x());
    add({{corner.x(), corner.y(), low},
         {along.x(), along.y(), 0},
         Vector3d::UnitZ(),
         width,
         high - low,
         seed,
         style});
  }

  void add_fronts(const PlanWall& wall, double height, int style) {
    const double length = (wall.to - wall.from).norm();
    for (int house = 0; house * kHouse < length - 1e-9; ++house) {
      const double first = house * kHouse;
      add_wall(wall, first, std::min(kHouse, length - first), 0, height, style, 0, next_seed());
    }
  }

  // The first panel is the ground, as large as all walls.
  void add_ground(const std::vector<PlanWall>& walls) {
    Vector2d low = walls.front().from, high = low;
    for (const PlanWall& wall : walls) {
      low = low.cwiseMin(wall.from).cwiseMin(wall.to);
      high = high.cwiseMax(wall.from).cwiseMax(wall.to);
    }
    add({{low.x(), low.y(), 0},
         Vector3d::UnitX(),
         Vector3d::UnitY(),
         high.x() - low.x(),
         high.y() - low.y(),
         next_seed(),
         kGround});
  }

  std::uint32_t next_seed() { return static_cast<std::uint32_t>(random_.next()); }
  PanelScene finish() { return PanelScene(std::move(panels_), street_styles()); }

 private:
  void add(const Panel& panel) { panels_.push_back(panel); }

  Random random_;
  std::vector<Panel> panels_;
};

}  // namespace

PanelScene make_street_scene(const StreetPlan& plan, std::uint32_t seed) {
  constexpr double kHouseHeight = 6, kCorridorHeight = 2.6;
  const bool corridor = !plan.door_walls.empty();
  StreetBuilder builder(seed);
  builder.add_ground(plan.walls());
  for (const PlanWall& wall : plan.walls()) {
    builder.add_fronts(wall, corridor ? kCorridorHeight : kHouseHeight, corridor ? kPlaster : kFront);
  }
  const std::uint32_t door_seed = builder.next_seed();
  for (const PlanWall& wall : plan.door_walls) {
    const double length = (wall.to - wall.from).norm();
    for (double first = 0.5; first + 1 < length; first += plan.door_spacing) {
      builder.add_wall(wall, first, 1, 0, 2.1, kDoor, 0.02, door_seed);
    }
  }
  return builder.finish();
}

std::vector<Rigid3> street_path(const StreetPlan& plan, int frames, std::uint64_t seed) {
  double step = kStep;
  if (frames > 0) step = length_of(rounded_way(plan, kStep)) / std::max(frames - 1, 1);
  std::vector<Waypoint> way = rounded_way(plan, step);
  if (frames > 0 && static_cast<int>(way.size()) > frames) way.resize(frames);
  Random random(seed);
  const Wander3 sway(20, 40, &random), turn(20, 40, &random);
  std::vector<Rigid3> path;
  for (std::size_t i = 0; i < way.size(); ++i) {
    const double done = static_cast<double>(i) / static_cast<double>(way.size());
    const Vector3d glance = 1.5 * kDegree * turn(done);
    const Vector3d position = Vector3d(way[i].at.x(), way[i].at.y(), kEyeLevel) + 0.05 * sway(done);
    const double heading = way[i].heading + plan.aside_deg * kDegree + glance.z();
    Eigen::Matrix3d map_from_camera;
    map_from_camera.col(2) = Vector3d(std::sin(heading), std::cos(heading), glance.x()).normalized();
    map_from_camera.col(0) = map_from_camera.col(2).cross(Vector3d::UnitZ()).normalized();
    map_from_camera.col(1) = map_from_camera.col(2).cross(map_from_camera.col(0));
    path.emplace_back(map_from_camera, position);
  }
  return path;
}

}  // namespace mono_pose_tracker
