#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>

#include "tracking/frame_registrar.h"

namespace mono_pose_tracker {

struct InnovationGateOptions {
  double gate = 22.46;       // chi-square of six degrees of freedom, 99.9 %
  int least_learnt = 15;     // innovations: fewer do not determine a variance
  double weight = 1.0 / 15;  // of the newest innovation in the variance: half a second at 30 Hz
  double clip = 9;  // variances. Motion has jerks: an innovation is clipped at three standard deviations
                    // when the variance is updated, so that a wrong pose does not admit the next
  double unexplained = 0.6;  // of the usual share: a wrong pose finds at most half of the expected points,
                             // and so does a blurred image, whose pose may be off as well
};

// Gates poses by their innovation: a pose is doubtful when it does not fit the previous motion and explains
// fewer of the expected points than usual, or is constrained by too few features. The camera is expected to
// continue its last motion; the variance of the innovation is learnt from the recording, for a hand as for a
// car. A quick rotation alone is no reason for doubt, as the landmarks that it brings into view are found.
// One thread.
class InnovationGate {
 public:
  // Called once for each registered frame, in order. predicted_camera_from_map: nothing where the frame
  // before had no pose. min_inliers: minimum of any pose. Returns the reason for doubt; nothing where there
  // is none.
  std::optional<std::string> judge(std::int64_t stamp_ns, const RegistrationReport& registration,
                                   const std::optional<Rigid3>& predicted_camera_from_map, int min_inliers);
  // Number of consecutive doubtful poses up to the last one.
  int in_a_row() const { return in_a_row_; }

  // The map or the place changes: the next pose does not continue the last one.
  void interrupt() {
    last_stamp_ns_.reset();
    in_a_row_ = 0;
  }
  // The unit of the map changes.
  void rescale(double scale) { translation_variance_ *= scale * scale; }
  void reset() { *this = {}; }

 private:
  std::optional<std::string> doubt_of(std::int64_t stamp_ns, const RegistrationReport& registration,
                                      const std::optional<Rigid3>& predicted_camera_from_map,
                                      int min_inliers);

  double learn(double variance, double squared) const;

  int in_a_row_ = 0;
  std::optional<std::int64_t> last_stamp_ns_;
  double usual_gap_ns_ = 0;  // between frames
  int learnt_ = 0;           // number of innovations
  double usual_share_ = 0;   // of the expected points that a pose finds
  // Variance of one coordinate of an innovation, at the usual gap.
  double rotation_variance_ = 0;     // rad^2
  double translation_variance_ = 0;  // (map units)^2, of the map in the camera frame
};

}  // namespace mono_pose_tracker
