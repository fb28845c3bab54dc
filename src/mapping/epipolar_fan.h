#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "mono_pose_tracker/map/image_features.h"

namespace mono_pose_tracker {

// Features sorted by the angle of their epipolar plane, so that the features near an epipolar line are found
// without a search of all others.
class EpipolarFan {
 public:
  struct NearPlane {
    int index;       // in the sorted order
    float distance;  // of the bearing from the plane, rad
  };

  // epipole: need not have unit length. Queries ask for features at distances from `least` (below 0) to
  // `most` (above 0) from a plane, rad.
  EpipolarFan(const ImageFeatures& image, const Eigen::Vector3d& epipole, const std::vector<int>& features,
              double least, double most);

  // Indices into the features of the image, in sorted order.
  const std::vector<int>& features() const { return features_; }

  // Finds the features at these distances from the plane through the epipole with this unit normal.
  void find_near(const Eigen::Vector3d& normal, std::vector<NearPlane>* near) const;

 private:
  // One column for each coordinate. Rows are padded with zeros to a multiple of the block size.
  using Bearings = Eigen::Array<float, Eigen::Dynamic, 3>;

  struct Range {
    int begin = 0, end = 0;
  };

  static int bin_of(double angle);
  void put_in_order(const ImageFeatures& image, const std::vector<int>& features,
                    const std::vector<int>& bins);
  std::array<Range, 4> ranges_near(double normal_angle) const;
  void find_in(int begin, int end, const Eigen::Vector3f& normal, std::vector<NearPlane>* near) const;

  const Eigen::Vector3d u_, v_;  // axes perpendicular to the epipole
  float middle_, half_;
  double from_normal_, to_normal_;  // range of plane angles for a bearing far from the epipole
  int close_ = 0;                   // number of features close to the epipole, which may be near every plane
  std::vector<int> features_, first_in_bin_;
  Bearings bearings_;
};

}  // namespace mono_pose_tracker
