#include "epipolar_fan.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace mono_pose_tracker {

namespace {

// Bins of the full angle: each holds a few of the 3000 features of a large image.
constexpr int kBins = 1024;

// Bearings that are tested at once.
constexpr int kBlock = 16;

// Distance from the epipole, in units of the largest distance from a plane. A feature farther off is near
// only those planes whose angle differs by less than the inverse, about 6 degrees.
constexpr double kFar = 10;

constexpr int kClose = -1;

int whole_blocks(int count) { return (count + kBlock - 1) / kBlock * kBlock; }

}  // namespace

EpipolarFan::EpipolarFan(const ImageFeatures& image, const Eigen::Vector3d& epipole,
                         const std::vector<int>& features, double least, double most)
    : u_(epipole.unitOrthogonal()),
      v_(epipole.normalized().cross(u_)),
      middle_(static_cast<float>(0.5 * (least + most))),
      half_(static_cast<float>(0.5 * (most - least))),
      first_in_bin_(kBins + 1, 0) {
  const double far = kFar * std::max(most, -least);
  from_normal_ = std::acos(most / far);
  to_normal_ = std::acos(least / far);
  std::vector<int> bins;  // of the features; those close to the epipole come first
  bins.reserve(features.size());
  for (const int f : features) {
    const double x = image.set.bearings[f].dot(u_), y = image.set.bearings[f].dot(v_);
    bins.push_back(x * x + y * y < far * far ? kClose : bin_of(std::atan2(y, x)));
    ++(bins.back() == kClose ? close_ : first_in_bin_[bins.back() + 1]);
  }
  first_in_bin_[0] = close_;
  for (int bin = 0; bin < kBins; ++bin) first_in_bin_[bin + 1] += first_in_bin_[bin];
  put_in_order(image, features, bins);
}

// Sorts the features by bin; the order within a bin is the given one.
void EpipolarFan::put_in_order(const ImageFeatures& image, const std::vector<int>& features,
                               const std::vector<int>& bins) {
  bearings_ = Bearings::Zero(whole_blocks(static_cast<int>(features.size())), 3);
  features_.resize(features.size());
  std::vector<int> next = first_in_bin_;
  int next_close = 0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const int place = bins[i] == kClose ? next_close++ : next[bins[i]]++;
    features_[place] = features[i];
    bearings_.row(place) = image.set.bearings[features[i]].cast<float>().transpose().array();
  }
}

int EpipolarFan::bin_of(double angle) {
  const double turns = angle / (2 * M_PI) + 0.5;
  if (!std::isfinite(turns)) return 0;  // no baseline, no epipolar plane
  return std::clamp(static_cast<int>(kBins * (turns - std::floor(turns))), 0, kBins - 1);
}

void EpipolarFan::find_near(const Eigen::Vector3d& normal, std::vector<NearPlane>* near) const {
  near->clear();
  const Eigen::Vector3f across = normal.cast<float>();
  int done = whole_blocks(close_);
  find_in(0, done, across, near);
  for (const Range& range : ranges_near(std::atan2(normal.dot(v_), normal.dot(u_)))) {
    if (range.begin == range.end) continue;
    const int begin = std::max(done, range.begin / kBlock * kBlock);
    done = std::max(done, whole_blocks(range.end));
    find_in(begin, done, across, near);
  }
}

// Ranges in the sorted order for both half-planes, each of which may wrap around. Unused ranges are empty.
std::array<EpipolarFan::Range, 4> EpipolarFan::ranges_near(double normal_angle) const {
  std::array<Range, 4> ranges{};
  const auto bins = [&](int first, int last) { return Range{first_in_bin_[first], first_in_bin_[last + 1]}; };
  for (int half = 0; half < 2; ++half) {
    const double from = normal_angle + (half == 0 ? from_normal_ : -to_normal_);
    const double to = normal_angle + (half == 0 ? to_normal_ : -from_normal_);
    const int first = bin_of(from), last = bin_of(to);
    if (first <= last) {
      ranges[2 * half] = bins(first, last);
    } else {
      ranges[2 * half] = bins(first, kBins - 1);
      ranges[2 * half + 1] = bins(0, last);
    }
  }
  std::sort(ranges.begin(), ranges.end(), [](const Range& a, const Range& b) { return a.begin < b.begin; });
  return ranges;
}

void EpipolarFan::find_in(int begin, int end, const Eigen::Vector3f& normal,
                          std::vector<NearPlane>* near) const {
  const int size = static_cast<int>(features_.size());
  for (int i = begin; i < end; i += kBlock) {
    const Eigen::Array<float, kBlock, 1> distances = bearings_.col(0).segment<kBlock>(i) * normal.x() +
                                                     bearings_.col(1).segment<kBlock>(i) * normal.y() +
                                                     bearings_.col(2).segment<kBlock>(i) * normal.z();
    if ((distances - middle_).abs().minCoeff() > half_) continue;
    for (int k = 0; k < kBlock && i + k < size; ++k) {
      if (std::abs(distances[k] - middle_) <= half_) near->push_back({i + k, distances[k]});
    }
  }
}

}  // namespace mono_pose_tracker
