#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/map/image_features.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

struct EpipolarMatchOptions {
  double max_error_rad = 0.004;   // angle between bearing and epipolar plane
  int max_distance2 = 0;          // of the descriptors
  double min_ratio = 1.25;        // second nearest over nearest, among the features near the epipolar line
  double max_scale_ratio = 3;     // of the two features: 1.6 octaves
  double max_chance_share = 0.2;  // of accidental matches; bundle adjustment and culling tolerate this share
  // Distance from the epipolar line to the centre of the decoy strip, in half widths. Features three half
  // widths off are no matches, whatever the errors of the poses.
  float decoy_strip = 4;
  int threads = 1;                 // the result is the same for any number
  CancelFlag cancelled = nullptr;  // once set, no matches are returned
};

// Guided matching (paper, step 4c) between features of two keyframes that have no landmark yet. Only features
// near the epipolar line are compared, and matches must be mutual nearest neighbours. A decoy strip next to
// the line estimates the number of accidental matches at each descriptor distance (target-decoy search, Elias
// and Gygi, Nature Methods 2007). Matches above the distance at which accidental ones are too frequent are
// excluded; with a wrong relative pose that is all of them.
std::vector<Match> match_along_epipolar_lines(const Keyframe& first, const Keyframe& second,
                                              const EpipolarMatchOptions& options);

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
