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

/// Writes trajectory, points, picture and COLMAP model: of the largest map to the output folder, of the
/// others to map_2, map_3, ... In the picture of an aligned map the cameras' down direction points to the
/// bottom.
void write_results(const std::filesystem::path& output, const CameraParameters& camera,
                   const RecordingResult& result, const std::vector<StampedPose>& reference,
                   const AlignedResult& aligned);

/// Writes overview.html of each map to the folder of its other results.
void write_pages(const std::filesystem::path& output, const CameraParameters& camera, const FrameNotes& notes,
                 const Thumbnails& thumbnails, const RecordingResult& result);

// These return early, with whole files, after the recording was interrupted.

/// Restricts the masks found by motion to the object's outline. Frames without a mask get one if
/// independently moving points were found in them, or if most of the other frames have one. Independent of
/// the number of threads.
void outline_masks(const Recording& recording, const RecordingResult& result, const CameraModel& camera,
                   MaskRecord* masks);

/// Writes the masks under the images' names.
void write_masks(const std::filesystem::path& folder, const Recording& recording,
                 const RecordingResult& result, const MaskRecord& masks);

/// Writes the images of a video or bag under their names in the COLMAP models.
void write_frames(const std::filesystem::path& folder, const Recording& recording,
                  const RecordingResult& result);

/// Writes a workspace for COLMAP's dense stage: images, masks (0 = ignore; COLMAP appends .png to the image's
/// name), the model in sparse, and the image lists of patch_match_stereo and stereo_fusion. The same folder
/// gets the data set that write_splat_dataset describes.
void write_undistorted(const std::filesystem::path& folder, const CameraModel& camera,
                       const Recording& recording, const RecordingResult& result, const MaskRecord& masks);

}  // namespace mono_pose_tracker
