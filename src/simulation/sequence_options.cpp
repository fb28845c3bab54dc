#include "simulation/sequence_options.h"

#include <sstream>
#include <stdexcept>
#include <string>

#include "io/image_decoding.h"

namespace mono_pose_tracker {
namespace {

void require(bool holds, const char* key, double value, const char* expected) {
  if (holds) return;
  std::ostringstream text;
  text.precision(15);
  text << key << " = " << value << ", expected " << expected;
  throw std::invalid_argument(text.str());
}

}  // namespace

void SequenceOptions::validate() const {
  require(frames >= 0 && frames <= kMaxFrames, "frames", frames, "0 (all) to 1000000");
  require(lead_in >= 0 && lead_in <= kMaxFrames, "lead_in", lead_in, "0 to 1000000");
  require_image_size();
  require(lead_in == 0 || has_head(scene), "lead_in", lead_in, "0: only scenes with a head have a lead-in");
  require(shine >= 0 && shine <= 1, "shine", shine, "0 to 1");
  require_what_has_it();
  require(noise_grey_levels >= 0, "noise_grey_levels", noise_grey_levels, "0 or more");
  require(blur_px >= 0 && blur_px <= 50, "blur_px", blur_px, "0 to 50");
  require(exposure_drift >= 0 && exposure_drift < 1, "exposure_drift", exposure_drift,
          "0 or more and less than 1");
  require(rate_hz >= kMinRateHz && rate_hz <= kMaxRateHz, "rate_hz", rate_hz, "0.001 to 1000000");
  require(rolling_shutter_s >= 0 && rolling_shutter_s * rate_hz <= 1, "rolling_shutter_s", rolling_shutter_s,
          "0 to 1 / rate_hz: the next image begins after it");
  require(rolling_shutter_s == 0 || !hand_held, "rolling_shutter_s", rolling_shutter_s,
          "0 with hand_held: the background has a global shutter");
  require(first_stamp_s >= 0 && first_stamp_s <= kMaxStampS, "first_stamp_s", first_stamp_s,
          "0 to 4294967295: the range of a message's stamp");
  require(samples >= 1 && samples <= 8, "samples", samples, "1 to 8");
  require(threads >= 0, "threads", threads, "0 (all) or more");
}

// Before anything is made of that size.
void SequenceOptions::require_image_size() const {
  if (camera.width <= 0 || camera.height <= 0) return;  // the camera model refuses them
  const double pixels = static_cast<double>(camera.width) * camera.height;
  require(pixels <= static_cast<double>(kMaxImagePixels), "width * height", pixels,
          "100000000 pixels at most");
}

// Options that only some scenes know.
void SequenceOptions::require_what_has_it() const {
  const bool living = shoulders != ShouldersKind::kNone || face.speaks || face.blinks || face.loose_hair;
  require(!living || scene == SceneKind::kHead, "shoulders, speaks, blinks, loose_hair", living,
          "0: only the head has them");
  require(shine == 0 || has_head(scene), "shine", shine, "0: only scenes with a head have reflections");
  require(background == BackgroundKind::kPlain || has_head(scene), "background", static_cast<int>(background),
          "0 (plain): only scenes with a head have a background");
  require(!hand_held || has_head(scene), "hand_held", hand_held, "0: only for scenes with a head");
  const bool still = background == BackgroundKind::kTextured || background == BackgroundKind::kWall;
  require(!hand_held || !still, "hand_held", hand_held, "0, or a background that is plain or a room");
  require(!hand_held || lead_in == 0, "hand_held", hand_held, "0 with a lead-in");
}

CameraParameters default_camera(SceneKind scene, int width, int height) {
  CameraParameters camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = (has_head(scene) ? 1.2 : 0.82) * width;  // 45 and 63 degrees wide
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  camera.distortion = {0, 0, 0, 0, 0};
  return camera;
}

}  // namespace mono_pose_tracker
