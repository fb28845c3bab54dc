#include "robust/accidental_matches.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace mono_pose_tracker {

namespace {

// How many wrong pairs chance brings near a line is told by those in two bands beside it, this far off in
// thresholds: beyond what noise brings there, wide enough for a handful to be in them, and still a small
// part of the image, over which wrong pairs are as dense.
constexpr double kNear = 2, kFar = 22;
constexpr double kShareNearLine = 1 / (kFar - kNear);
// Distances along the line: up to two thresholds, then each twice the one before.
constexpr int kClasses = 12;
// A class counts where chance alone would so rarely bring as many near the lines: the motion is the one of
// many that is nearest to most.
constexpr double kMostChance = 1e-3;
// Where fewer of the pairs near the lines would be left than this share, they are too few to be classed: half
// of 500 pairs wrong bring a handful there.
constexpr double kLeastShare = 0.8;

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
  place.along = along < 2 ? 0 : std::min(kClasses - 1, static_cast<int>(std::log2(along)));
  return place;
}

// Probability of `count` or more where `expected` are expected (Poisson).
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
                                   const Eigen::Vector3d& normal, double threshold) {
  std::vector<Place> places;
  std::array<int, kClasses> near{}, off_line{};
  for (int i = 0; i < pairs.size(); ++i) {
    const Place place = place_of(pairs.first()[i], pairs.second()[i], model, normal, threshold);
    places.push_back(place);
    if (place.along < 0) continue;
    near[place.along] += place.off < 1;
    off_line[place.along] += place.off > kNear && place.off < kFar;
  }
  std::array<bool, kClasses> is_more{};
  int all = 0, left = 0, wrong = 0;
  for (int k = 0; k < kClasses; ++k) {
    is_more[k] = chance_of(near[k], (off_line[k] + 1) * kShareNearLine) < kMostChance;
    wrong += off_line[k];
    all += near[k];
    left += is_more[k] ? near[k] : 0;
  }
  std::vector<char> flags(pairs.size(), 1);
  if (wrong == 0 || left < kLeastShare * all) return flags;
  for (int i = 0; i < pairs.size(); ++i) flags[i] = places[i].along < 0 || is_more[places[i].along];
  return flags;
}

}  // namespace mono_pose_tracker
