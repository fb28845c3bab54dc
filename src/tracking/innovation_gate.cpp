#include "innovation_gate.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/rotation.h"
#include "common/text.h"

namespace mono_pose_tracker {

constexpr InnovationGateOptions kGate{};

double InnovationGate::learn(double variance, double squared) const {
  const double weight = std::max(kGate.weight, 1.0 / (learnt_ + 1));
  const double clipped = learnt_ < kGate.least_learnt ? squared : std::min(squared, kGate.clip * variance);
  return (1 - weight) * variance + weight * clipped;
}

std::optional<std::string> InnovationGate::judge(std::int64_t stamp_ns,
                                                 const RegistrationReport& registration,
                                                 const std::optional<Rigid3>& predicted, int min_inliers) {
  std::optional<std::string> doubt = doubt_of(stamp_ns, registration, predicted, min_inliers);
  in_a_row_ = doubt ? in_a_row_ + 1 : 0;
  return doubt;
}

std::optional<std::string> InnovationGate::doubt_of(std::int64_t stamp_ns,
                                                    const RegistrationReport& registration,
                                                    const std::optional<Rigid3>& predicted, int min_inliers) {
  const std::optional<std::int64_t> last = std::exchange(last_stamp_ns_, stamp_ns);
  // Twice the minimum of inliers is accepted wherever they are: a small object may have many features.
  if (registration.inliers < 2 * min_inliers && is_confined_to_corner(registration.support)) {
    return formatted("%d inliers in %.0f %% of the area with visible landmarks", registration.inliers,
                     100 * registration.support.spread);
  }
  if (!last || !predicted) return std::nullopt;
  const double gap_ns = static_cast<double>(std::max<std::int64_t>(1, stamp_ns - *last));
  // Averaged over about ten frames: a dropped frame changes it little, another rate soon.
  usual_gap_ns_ = usual_gap_ns_ == 0 ? gap_ns : 0.9 * usual_gap_ns_ + 0.1 * gap_ns;
  // The effect of acceleration grows with the square of time.
  const double growth = std::pow(std::max(1.0, gap_ns / usual_gap_ns_), 2);

  const Rigid3 found_from_predicted = registration.camera_from_map * predicted->inverse();
  const double whole_turn = Eigen::AngleAxisd(found_from_predicted.rotation).angle();
  const double whole_shift = found_from_predicted.translation.norm();
  const double turn = whole_turn / growth, shift = whole_shift / growth;  // per usual gap
  const double rotation_variance =
      rotation_variance_ + registration.covariance.bottomRightCorner<3, 3>().trace() / 3;
  const double translation_variance =
      translation_variance_ + registration.covariance.topLeftCorner<3, 3>().trace() / 3;
  const double distance2 = turn * turn / rotation_variance + shift * shift / translation_variance;
  const double share =
      static_cast<double>(registration.support.found) / std::max(1.0, registration.support.in_map.expected);
  // A pose after a doubtful one needs the support of a relocalisation.
  const bool goes_on_in_doubt = in_a_row_ > 0 && !is_supported(registration.support, min_inliers);
  const bool is_outlier =
      learnt_ >= kGate.least_learnt &&
      (goes_on_in_doubt || (distance2 > kGate.gate && share < kGate.unexplained * usual_share_));
  if (!is_outlier) usual_share_ += std::max(kGate.weight, 1.0 / (learnt_ + 1)) * (share - usual_share_);
  rotation_variance_ = learn(rotation_variance_, turn * turn / 3);
  translation_variance_ = learn(translation_variance_, shift * shift / 3);
  ++learnt_;
  if (!is_outlier) return std::nullopt;
  return formatted(
      "%.2f deg and %.3g units from the predicted motion, %.1f times the usual deviation, and %.0f %% of the "
      "expected points found",
      whole_turn / kDegree, whole_shift, std::sqrt(distance2 / 6), 100 * share);
}

}  // namespace mono_pose_tracker
