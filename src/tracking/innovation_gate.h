#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>

#include "tracking/frame_registrar.h"

namespace mono_pose_tracker {

// Which poses don't fit the motion so far and explain less of what they show than usual, or hang on too
// little. A camera is expected to go on as it moved last; how well it does is learnt from the recording
// itself: what a hand does to it, what a car does. A quick turn alone is no reason for doubt: what the pose
// brings into view is found. One thread.
class InnovationGate {
 public:
  // Asked once for each posed frame, in order. predicted_camera_from_map: nothing where the frame before had
  // no pose. min_inliers: of any pose. What speaks against it, in words; nothing when nothing does.
  std::optional<std::string> judge(std::int64_t stamp_ns, const RegistrationReport& registration,
                                   const std::optional<Rigid3>& predicted_camera_from_map, int min_inliers);
  // Those that were doubted in a row, up to the last.
  int in_a_row() const { return in_a_row_; }

  // Another map or another place: what comes next is no continuation.
  void interrupt() {
    last_stamp_ns_.reset();
    in_a_row_ = 0;
  }
  // Lengths of the map have another unit.
  void rescale(double scale) { translation_variance_ *= scale * scale; }
  void reset() { *this = InnovationGate(); }

 private:
  std::optional<std::string> doubt_of(std::int64_t stamp_ns, const RegistrationReport& registration,
                                      const std::optional<Rigid3>& predicted_camera_from_map,
                                      int min_inliers);

  int in_a_row_ = 0;
  std::optional<std::int64_t> last_stamp_ns_;
  double usual_gap_ns_ = 0;  // between frames
  int learnt_ = 0;           // innovations
  double usual_share_ = 0;   // of the points to be expected that a pose finds
  // Of one coordinate of an innovation, at the usual gap.
  double rotation_variance_ = 0;     // rad^2
  double translation_variance_ = 0;  // (map units)^2, of the map seen from the camera
};

}  // namespace mono_pose_tracker
