#pragma once

namespace mono_pose_tracker {

/// The parts of the work on a recording. Refining and registering take turns.
enum class RecordingStage { kTracking, kRefining, kRegistering, kWriting };

}  // namespace mono_pose_tracker
