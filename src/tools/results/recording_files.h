#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "../viewer/scene_page.h"
#include "alignment.h"
#include "mapping/view_graph.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/io/trajectory.h"
#include "mono_pose_tracker/map/map.h"
#include "pipeline/recording.h"
#include "report.h"

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

/// The two-view geometries as JSON lines, an edge each, for debugging and plots: {"frames": [a, b], "type":
/// "calibrated", "matches": n, "inliers": [n1, n2], "explained": k}. inliers: verified matches of the
/// dominant and of the second motion; explained: of those of the map's object, by the map; null where the map
/// does not hold both images. Throws std::runtime_error naming the path when it cannot be written.
void write_view_graph(const std::string& path, const ViewGraph& graph, const Map& map);

/// The same as a picture: a square for each pair of images, from red (the map explains no verified match) to
/// green (it explains all); grey where the map does not hold both images. Throws as above.
void draw_view_graph(const std::string& path, const ViewGraph& graph, const Map& map);

}  // namespace mono_pose_tracker
