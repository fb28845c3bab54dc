#pragma once

namespace mono_pose_tracker {

/// scene_page.html of this folder, which the build turns into a string; @SCENE@ stands where the data go.
extern const char kScenePageText[];

}  // namespace mono_pose_tracker
