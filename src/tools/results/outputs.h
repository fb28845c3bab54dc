#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "../inputs.h"
#include "io/image_source.h"

namespace mono_pose_tracker {

/// Where track_sequence writes; empty: it does not.
struct Outputs {
  std::filesystem::path folder, map, masks;
  bool undistorted = false, frames = false, refined_camera = false;  // in the folder
  std::filesystem::path view_graph;
  bool view_graph_picture = false;  // in the folder
};

/// The masks in the folder that belong to the images (none: frames of a video or bag): of what else is below
/// it nothing is read.
void add_masks(const std::filesystem::path& folder, const std::vector<ImageFile>& images, Inputs* inputs);

/// Throws std::runtime_error naming the path when anything of the outputs is one of the inputs, or what
/// another of the options writes. `images`: none: frames of a video or bag.
void refuse_to_overwrite(const Inputs& inputs, const std::vector<ImageFile>& images, const Outputs& outputs);

/// Throws std::runtime_error naming the folder when pictures of the results would lie among the images: a
/// folder is read more than once, and would have images in it that it had not before. `images`: a folder, a
/// list (whose images are where it says) or empty.
void refuse_among_images(const std::filesystem::path& images, const Outputs& outputs);

/// Makes the folders. No trajectory of an earlier run is left, live or of any of its maps, which could be
/// taken for this one's. Throws std::runtime_error naming the path and the reason when something could not be
/// written.
void require_writable(const Outputs& outputs);

/// What an earlier run has left in the folder and this one, which made so many maps, has not written anew;
/// but not the calibration that it was made with.
std::vector<std::filesystem::path> earlier_files(const Outputs& outputs, const std::filesystem::path& camera,
                                                 std::size_t maps);

}  // namespace mono_pose_tracker
