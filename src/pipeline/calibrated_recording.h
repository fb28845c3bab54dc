#pragma once

#include <string>

#include "pipeline/recording.h"
#include "pipeline/self_calibration.h"

namespace mono_pose_tracker {

// What is added to tracking a recording when its camera is refined:
//
//   refined = calibrate_by_tracking(camera, source, refinement, [&](camera, max_keyframes) {
//     ... max_keyframes > 0 ? track_beginning(...) : track_until_confirmed(...);
//   });
//   add_calibration_findings(refined, refinement, *tracker, &result);
//
// and when it is given:
//
//   track_until_confirmed(with_calibration_test(recording, refinement, camera), ...);
//   add_calibration_test(refinement, camera, *tracker, &result);

/// The options of a refinement within tracking, but for `cancel`.
CameraRefinementOptions refinement_options(const TrackerOptions& options);

/// As track_recording, until the map has max_keyframes keyframes.
RecordingResult track_beginning(Recording recording, int max_keyframes, const FrameObserver& observer,
                                Tracker* tracker);

/// Adds evidence against the camera, which is evidence against every map: none of them is confirmed. No
/// effect where `why` is empty or there is no map.
void add_calibration_doubt(const std::string& why, RecordingResult* result);

/// The recording with doubt_of set: tests the given camera in parallel with the other checks.
Recording with_calibration_test(Recording recording, const CameraRefinementOptions& refinement,
                                const CameraParameters& camera);
/// Adds the result of this test, which is made now where it was not.
void add_calibration_test(const CameraRefinementOptions& refinement, const CameraParameters& camera,
                          const Tracker& tracker, RecordingResult* result);

/// Adds the warnings of a refinement to the result of its last run. A camera that was not refined is tested
/// against the tracker's map.
void add_calibration_findings(const SelfCalibration& refined, const CameraRefinementOptions& refinement,
                              const Tracker& tracker, RecordingResult* result);

}  // namespace mono_pose_tracker
