#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "../written_files.h"
#include "io/image_source.h"

namespace mono_pose_tracker {

/// Output paths of track_sequence; empty: not written.
struct Outputs {
  std::filesystem::path folder, map, masks;
  bool undistorted = false, frames = false, refined_camera = false;  // in the folder
  std::filesystem::path view_graph;
  bool view_graph_picture = false;  // in the folder
};

/// The masks in the folder that belong to the images (none: frames of a video or bag). Other files below it
/// are not read.
void add_masks(const std::filesystem::path& folder, const std::vector<ImageFile>& images, Inputs* inputs);

/// Throws std::runtime_error naming the path when an output is one of the inputs, or is written by another
/// option. `images`: none: frames of a video or bag.
void refuse_to_overwrite(const Inputs& inputs, const std::vector<ImageFile>& images, const Outputs& outputs);

/// Throws std::runtime_error naming the folder when pictures of the results would be written among the
/// images: the folder is read again, and would then hold them. `images`: a folder, a list (its images are
/// checked) or empty.
void refuse_among_images(const std::filesystem::path& images, const Outputs& outputs);

/// Makes the folders. Removes trajectories of an earlier run, live or of any of its maps, which could be
/// mistaken for those of this run. Throws std::runtime_error naming the path and the reason when something
/// cannot be written.
void require_writable(const Outputs& outputs);

/// Files of an earlier run in the folder that this run, with so many maps, has not replaced; not the
/// calibration used for it.
std::vector<std::filesystem::path> earlier_files(const Outputs& outputs, const std::filesystem::path& camera,
                                                 std::size_t maps);

}  // namespace mono_pose_tracker
