#pragma once

#include <Eigen/Core>
#include <cmath>

#include "common/random.h"

namespace mono_pose_tracker {

/// A smooth wandering within [-1, 1]: a few sines of seeded phase and frequency.
class Wander {
 public:
  /// `slowest` and `fastest`: cycles per unit of the argument.
  Wander(double slowest, double fastest, Random* random) {
    for (int i = 0; i < kSines; ++i) {
      frequency_[i] = random->uniform(slowest, fastest);
      phase_[i] = random->uniform(0, 2 * M_PI);
    }
  }
  double operator()(double s) const {
    double sum = 0;
    for (int i = 0; i < kSines; ++i) sum += std::sin(2 * M_PI * frequency_[i] * s + phase_[i]);
    return sum / kSines;
  }

 private:
  static constexpr int kSines = 4;
  double frequency_[kSines];
  double phase_[kSines];
};

class Wander3 {
 public:
  Wander3(double slowest, double fastest, Random* random)
      : x_(slowest, fastest, random), y_(slowest, fastest, random), z_(slowest, fastest, random) {}
  Eigen::Vector3d operator()(double s) const { return {x_(s), y_(s), z_(s)}; }

 private:
  Wander x_, y_, z_;
};

}  // namespace mono_pose_tracker
