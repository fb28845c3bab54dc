#include "pipeline/calibrated_recording.h"

#include <atomic>
#include <functional>
#include <utility>

#include "mono_pose_tracker/tracking/tracker.h"

namespace mono_pose_tracker {

CameraRefinementOptions refinement_options(const TrackerOptions& options) {
  CameraRefinementOptions refinement;
  refinement.loss_width = options.bundle.loss_width;
  refinement.num_threads = options.bundle.num_threads;
  return refinement;
}

RecordingResult track_beginning(Recording recording, int max_keyframes, const FrameObserver& observer,
                                Tracker* tracker) {
  std::atomic<bool> has_enough{false};
  recording.interrupted = [&has_enough, interrupted = recording.interrupted] {
    return has_enough || interrupted();
  };
  return track_recording(
      recording,
      [&](int pass, std::int64_t index, const FrameReport& report) {
        observer(pass, index, report);
        if (report.keyframes >= max_keyframes) has_enough = true;
      },
      tracker);
}

void add_calibration_doubt(const std::string& why, RecordingResult* result) {
  if (why.empty() || !result->tracked) return;
  Finding finding;
  finding.kind = FindingKind::kCalibration;
  finding.text = why;
  add_finding(std::move(finding), result);
}

Recording with_calibration_test(Recording recording, const CameraRefinementOptions& refinement,
                                const CameraParameters& camera) {
  recording.doubt_of = [refinement, camera](const Map& map, const std::function<bool()>& cancelled) {
    CameraRefinementOptions cancellable = refinement;
    cancellable.cancel = [&] { return cancelled() || (refinement.cancel && refinement.cancel()); };
    return doubt_of_calibration(cancellable, camera, map);
  };
  return recording;
}

void add_calibration_test(const CameraRefinementOptions& refinement, const CameraParameters& camera,
                          const Tracker& tracker, RecordingResult* result) {
  if (!result->tracked) return;
  add_calibration_doubt(
      result->doubt ? *result->doubt : doubt_of_calibration(refinement, camera, tracker.map()), result);
}

void add_calibration_findings(const SelfCalibration& refined, const CameraRefinementOptions& refinement,
                              const Tracker& tracker, RecordingResult* result) {
  for (const std::string& warning : refined.warnings) {
    Finding finding;
    finding.kind = FindingKind::kCalibration;
    finding.is_disqualifying = !refined.is_near;
    finding.text = warning;
    add_finding(std::move(finding), result);
  }
  if (refined.source != CalibrationSource::kRefined) {
    result->doubt.reset();
    add_calibration_test(refinement, refined.camera, tracker, result);
  }
}

}  // namespace mono_pose_tracker
