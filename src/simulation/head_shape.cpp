#include "simulation/head_shape.h"

#include <algorithm>
#include <cmath>

#include "simulation/ray_march.h"
#include "simulation/solid_parts.h"

namespace mono_pose_tracker {
namespace {

using Eigen::Vector3d;

const Ellipsoid kCranium({0, -0.025, 0.012}, {0.076, 0.092, 0.098});
const Ellipsoid kMidface({0, 0.030, -0.018}, {0.063, 0.085, 0.074});
const Ellipsoid kJaw({0, 0.066, -0.030}, {0.056, 0.050, 0.056});
const Ellipsoid kBrow({0.027, -0.021, -0.080}, {0.026, 0.007, 0.011});
const Ellipsoid kUpperLip({0, 0.0665, -0.083}, {0.024, 0.0065, 0.010});
const Ellipsoid kLowerLip({0, 0.0770, -0.081}, {0.020, 0.0075, 0.010});
const Ellipsoid kEar({0, 0, 0}, {0.009, 0.032, 0.020});

double skull(const Vector3d& p, bool with_neck) {
  double d = ellipsoid(p, kCranium);
  d = blend(d, ellipsoid(p, kMidface), 0.03);
  d = blend(d, ellipsoid(p, kJaw), 0.03);
  if (!with_neck) return d;
  return blend(d, tapered_capsule(p, {0, 0.06, 0.030}, {0, 0.30, 0.050}, 0.052, 0.078), 0.04);
}

double face(const Vector3d& p, double d) {
  d = blend(d, sphere(p, {0, 0.101, -0.070}, 0.018), 0.03);
  d = blend(d, sphere(p, {0.041, 0.028, -0.060}, 0.024), 0.04);
  d = blend(d, ellipsoid(p, kBrow), 0.025);
  d = carve(d, sphere(p, {0.033, 0.002, -0.110}, 0.019), 0.015);
  d = blend(d, sphere(p, {0.032, 0.003, -0.0775}, 0.0140), 0.004);
  d = blend(d, tapered_capsule(p, {0, -0.012, -0.085}, {0, 0.036, -0.110}, 0.007, 0.0105), 0.014);
  d = blend(d, sphere(p, {0.0110, 0.0405, -0.0985}, 0.0075), 0.010);
  d = blend(d, ellipsoid(p, kUpperLip), 0.008);
  d = blend(d, ellipsoid(p, kLowerLip), 0.007);
  return d;
}

double ear(const Vector3d& p) {
  // Flared 25 degrees from the skull.
  constexpr double c = 0.906, s = 0.423;
  const Vector3d q = p - Vector3d(0.080, 0.012, 0.020);
  const Vector3d r(c * q.x() - s * q.z(), q.y(), s * q.x() + c * q.z());
  const double shell = ellipsoid(r, kEar);
  return carve(shell, sphere(r, {0.013, 0.002, -0.002}, 0.0125), 0.005);
}

}  // namespace

double head_distance(const Vector3d& x_in_head, bool with_neck) {
  const double outside = (x_in_head - head_bound_centre()).norm() - kHeadBoundRadius;
  if (outside > 0.05) return outside;
  // Symmetric. Smooth over 3 mm at the middle, where a plain |x| would leave a crease.
  const Vector3d p(std::sqrt(x_in_head.x() * x_in_head.x() + 9e-6), x_in_head.y(), x_in_head.z());
  double d = skull(p, with_neck);
  // Parts far enough not to reach the skull here by their blend (its width: 0.03 m and 0.008 m) count by a
  // ball around them; a blended surface stands out from both parts by a quarter of the width at most.
  const double to_face = sphere(p, {0, 0.035, -0.070}, 0.09);
  d = to_face < 0.03 ? face(p, d) : std::min(d, to_face - 0.008);
  const double to_ear = sphere(p, {0.082, 0.012, 0.020}, 0.036);
  return to_ear < 0.03 ? blend(d, ear(p), 0.008) : std::min(d, to_ear - 0.002);
}

}  // namespace mono_pose_tracker
