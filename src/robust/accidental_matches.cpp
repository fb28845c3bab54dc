#include "robust/accidental_matches.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace mono_pose_tracker {

namespace {

// Classes of distance along the line: up to two thresholds, then doubling.
constexpr int kClasses = 12;
struct Place {
  double off = 0;  // from the epipolar line, in thresholds
  int along = -1;  // class of the distance along it; -1: behind a camera
};

Place place_of(const Eigen::Vector3d& x1, const Eigen::Vector3d& x2, const TwoViewModel& model,
               const Eigen::Vector3d& normal, double threshold) {
  const Eigen::Vector3d turned = model.rotation * x1;
  const Eigen::Vector3d across1 = turned.cross(model.translation), across2 = x2.cross(model.translation);
  const double squares = across1.squaredNorm() + across2.squaredNorm();
  Place place;
  place.off = std::abs(x2.dot(across1)) / std::sqrt(squares + kTinySine) / threshold;
  if (!may_be_in_front(model, x1, x2, threshold)) return place;
  const double inverse_distance = -across2.dot(x2.cross(turned)) / std::max(across2.squaredNorm(), 1e-12);
  const double of_plane = normal.dot(x1);
  const double along = std::abs(inverse_distance - of_plane) * across2.norm() /
                       (turned + of_plane * model.translation).norm() / threshold;
  // The last class also takes what is infinite or not a number: the plane's point is in the second camera.
  const double farthest = 1 << (kClasses - 1);
  place.along = along < 2 ? 0 : static_cast<int>(std::log2(std::min(farthest, along)));
  return place;
}

// Poisson probability of `count` or more events where `expected` are expected.
double chance_of(int count, double expected) {
  double term = std::exp(-expected), fewer = 0;
  for (int i = 0; i < count; ++i) {
    fewer += term;
    term *= expected / (i + 1);
  }
  return std::max(0.0, 1 - fewer);
}

}  // namespace

std::vector<char> more_than_chance(const BearingPairs& pairs, const TwoViewModel& model,
                                   const Eigen::Vector3d& normal, double threshold,
                                   const AccidentalMatchOptions& options) {
  std::vector<Place> places;
  std::array<int, kClasses> near{}, off_line{};
  for (int i = 0; i < pairs.size(); ++i) {
    const Place place = place_of(pairs.first()[i], pairs.second()[i], model, normal, threshold);
    places.push_back(place);
    if (place.along < 0) continue;
    near[place.along] += place.off < 1;
    off_line[place.along] += place.off > options.nearest && place.off < options.farthest;
  }
  std::array<bool, kClasses> is_more{};
  int all = 0, left = 0, wrong = 0;
  const double share_near_line = 1 / (options.farthest - options.nearest);
  for (int k = 0; k < kClasses; ++k) {
    is_more[k] = chance_of(near[k], (off_line[k] + 1) * share_near_line) < options.max_chance;
    wrong += off_line[k];
    all += near[k];
    left += is_more[k] ? near[k] : 0;
  }
  std::vector<char> flags(pairs.size(), 1);
  if (wrong == 0 || left < options.min_share * all) return flags;
  for (int i = 0; i < pairs.size(); ++i) flags[i] = places[i].along < 0 || is_more[places[i].along];
  return flags;
}

}  // namespace mono_pose_tracker
