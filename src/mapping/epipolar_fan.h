#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

// Features in the order in which a plane that turns round the epipole passes them, so that those near an
// epipolar line are found without looking at all others.
class EpipolarFan {
 public:
  struct NearPlane {
    int index;       // in that order
    float distance;  // of the bearing from the plane, rad
  };

  // epipole: of any length; what is looked for is from `least` (below 0) to `most` (above 0) from a plane,
  // rad.
  EpipolarFan(const ImageFeatures& image, const Eigen::Vector3d& epipole, const std::vector<int>& features,
              double least, double most);

  // As features of the image.
  const std::vector<int>& features() const { return features_; }

  // Those at these distances from the plane through the epipole with that normal, of length 1.
  void find_near(const Eigen::Vector3d& normal, std::vector<NearPlane>* near) const;

 private:
  // A column a coordinate; rows up to a whole number of blocks, the last ones 0.
  using Bearings = Eigen::Array<float, Eigen::Dynamic, 3>;

  struct Range {
    int begin = 0, end = 0;
  };

  static int bin_of(double angle);
  void put_in_order(const ImageFeatures& image, const std::vector<int>& features,
                    const std::vector<int>& bins);
  std::array<Range, 4> ranges_near(double normal_angle) const;
  void find_in(int begin, int end, const Eigen::Vector3f& normal, std::vector<NearPlane>* near) const;

  const Eigen::Vector3d u_, v_;  // across the epipole
  float middle_, half_;
  double from_normal_, to_normal_;  // angles between which a bearing far from the epipole must be turned
  int close_ = 0;                   // so many are close to the epipole: every plane may be near them
  std::vector<int> features_, first_in_bin_;
  Bearings bearings_;
};

}  // namespace mono_pose_tracker
