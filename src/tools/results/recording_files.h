#pragma once

#include <filesystem>
#include <vector>

#include "../viewer/recording_page.h"
#include "alignment.h"
#include "mask_record.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/io/trajectory.h"
#include "tracking/recording.h"

namespace mono_pose_tracker {

/// Trajectory, points, picture and COLMAP model: the largest map's in the output folder, the others' in
/// map_2, map_3, ... The picture of a map that was aligned is drawn with the cameras' down towards the
/// bottom.
void write_results(const std::filesystem::path& output, const CameraParameters& camera,
                   const RecordingResult& result, const std::vector<StampedPose>& reference,
                   const AlignedResult& aligned);

/// overview.html of each map, beside its other results.
void write_pages(const std::filesystem::path& output, const CameraParameters& camera, const FrameNotes& notes,
                 const Thumbnails& thumbnails, const RecordingResult& result);

// These end early, each file of them whole, once the recording is interrupted.

/// The masks in force, where the tracker has found them by what moves, cut down to the body's outline; frames
/// without one get it where something was seen to move otherwise than the map, or most of the others have
/// one. The same on any number of threads.
void outline_masks(const Recording& recording, const RecordingResult& result, const CameraModel& camera,
                   MaskRecord* masks);

/// The masks under the images' names.
void write_masks(const std::filesystem::path& folder, const Recording& recording,
                 const RecordingResult& result, const MaskRecord& masks);

/// The images of a video or bag, under the names that the COLMAP models have for them.
void write_frames(const std::filesystem::path& folder, const Recording& recording,
                  const RecordingResult& result);

/// A workspace of COLMAP's dense stage: images, masks (0 = ignore; COLMAP appends .png to the image's name),
/// the model in sparse, and which images patch_match_stereo and stereo_fusion are to work on. Beside it, in
/// the same folder, the data set that write_splat_dataset describes.
void write_undistorted(const std::filesystem::path& folder, const CameraModel& camera,
                       const Recording& recording, const RecordingResult& result, const MaskRecord& masks);

}  // namespace mono_pose_tracker
