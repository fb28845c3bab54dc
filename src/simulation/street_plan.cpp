#include "street_plan.h"

#include <cmath>

#include "common/rotation.h"

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

}  // namespace mono_pose_tracker
