#pragma once

#include <array>
#include <string>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {

/// Range of fields of view that may be guessed, in degrees. Outside it a pinhole camera makes little sense.
constexpr double kMinHfovDeg = 5, kMaxHfovDeg = 150;

/// A camera of which only the horizontal field of view is known: square pixels, the principal point in the
/// image centre, no distortion. hfov_deg: from the left to the right edge of the image. Throws
/// std::invalid_argument, one line, on an angle out of range or an empty image.
CameraParameters guess_camera(int width_px, int height_px, double hfov_deg);

/// Largest shift of a pixel by an ignored skew [px]. It is below the localisation error of features. The
/// default options of camera_calibration leave some hundredths in a fisheye calibration.
inline constexpr double kMaxSkewShiftPx = 0.5;

/// Checks a camera matrix given row by row: fx skew cx 0 fy cy 0 0 1. The camera model has no skew. A skew
/// that moves no pixel of an image of this height by more than kMaxSkewShiftPx is ignored. Returns a one-line
/// note about an ignored skew, empty below 0.001 px. Throws std::invalid_argument on any other matrix, with a
/// text that continues the matrix's name.
std::string require_camera_matrix(const std::array<double, 9>& matrix, int height_px);

/// Difference below which two calibrations are equal [px]: 1 % of the localisation error of features. Drivers
/// that compute their calibration for each image round it differently each time.
inline constexpr double kCalibrationRoundingPx = 1e-3;

/// Change of the calibration that is tolerated [px]: it is below the localisation error of features. Drivers
/// that estimate the calibration for each image (autofocus, image stabilisation of a phone) vary it by tenths
/// of a pixel.
inline constexpr double kToleratedCalibrationChangePx = 0.2;

/// Whether two calibrations are of one camera: the image sizes are equal, and no pixel's viewing ray differs
/// by more than the tolerance [px]. steps: of a grid of pixels across the image, whose rays are compared;
/// distortion has no finer structure.
bool is_same_camera(const CameraParameters& a, const CameraParameters& b,
                    double tolerance_px = kCalibrationRoundingPx, int steps = 8);

/// In words, of two cameras that are not the same.
std::string difference(const CameraParameters& a, const CameraParameters& b);

/// Describes an image whose size differs from that of the calibration: both sizes, the origin of the expected
/// one, and the likely cause. One line that continues "the image ". origin: "image_width and image_height of
/// camera.yaml"; empty: not known.
std::string size_mismatch_text(int image_width, int image_height, int camera_width, int camera_height,
                               const std::string& origin);

/// Whether images are rectified already: then P of the calibration holds, and no distortion.
struct Rectification {
  bool is_rectified = false;
  std::string reason;  // one line: who decided so
};

/// Values of the option `rectified`, the default first.
inline const std::vector<std::string> kRectifiedSettings = {"auto", "true", "false"};

/// Decides for recordings and for live images. setting: one of kRectifiedSettings. auto: rectified if the
/// base name of the topic begins with image_rect (/camera/image_rect_color, also its /compressed).
/// image_topic: empty for files, which auto treats as raw images.
Rectification decide_rectification(const std::string& setting, const std::string& image_topic);

/// A one-line warning if the setting contradicts the topic or calibration, with what to do; empty: none.
/// has_distortion: the calibration has non-zero coefficients, so that raw and rectified images differ.
std::string rectification_contradiction(const std::string& setting, const std::string& image_topic,
                                        bool has_distortion);

}  // namespace mono_pose_tracker
