#include "outputs.h"

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <stdexcept>

#include "mono_pose_tracker/common/system_error.h"
#include "mono_pose_tracker/io/atomic_file.h"

namespace mono_pose_tracker {

namespace fs = std::filesystem;

namespace {

// Whether a file can be made there is only known by making one, which goes again.
void try_to_write(const fs::path& folder, const std::string& what) {
  const std::string path = (folder / ".writable").string();
  errno = 0;
  const bool made = std::ofstream(path).is_open();
  const int reason = errno;
  std::remove(path.c_str());
  if (made) return;
  throw std::runtime_error(what + ": cannot be written (" + system_error_text(reason) + ")");
}

void require_writable_folder(const fs::path& folder) {
  make_folder(folder);
  try_to_write(folder, folder.string());
}

void require_writable_file(const fs::path& path) {
  const fs::path written = fs::weakly_canonical(fs::absolute(path));  // what a link leads to
  const fs::path folder = written.parent_path();
  if (!fs::is_directory(folder)) {
    throw std::runtime_error(path.string() + ": cannot be written (" + folder.string() + " is no folder)");
  }
  require_regular_file(path.string());
  try_to_write(folder, path.string());
}

// The files in the output folder itself, whatever comes of the recording.
std::vector<fs::path> result_files(const Outputs& outputs) {
  std::vector<fs::path> files;
  for (const char* name :
       {"trajectory.txt", "trajectory_live.txt", "points.ply", "overview.png", "report.json"}) {
    files.push_back(outputs.folder / name);
  }
  if (outputs.refined_camera) files.push_back(outputs.folder / "camera_refined.yaml");
  return files;
}

}  // namespace

void refuse_to_overwrite(const Inputs& inputs, const std::vector<ImageFile>& images, const Outputs& outputs) {
  for (const fs::path& file : result_files(outputs)) inputs.refuse_to_overwrite(file);
  inputs.refuse_to_overwrite(outputs.map);
  inputs.refuse_to_overwrite(outputs.masks);
  for (const ImageFile& image : images) {
    const fs::path name = image.name;
    if (outputs.undistorted) inputs.refuse_to_overwrite(outputs.folder / "undistorted" / "images" / name);
    if (outputs.masks.empty()) continue;
    inputs.refuse_to_overwrite(outputs.masks / fs::path(name).replace_extension(".png"));
    inputs.refuse_to_overwrite(outputs.masks / fs::path(image.name + ".png"));
  }
}

void require_writable(const Outputs& outputs) {
  for (const fs::path& file : result_files(outputs)) require_regular_file(file.string());
  if (!outputs.map.empty()) require_writable_file(outputs.map);
  if (!outputs.masks.empty()) require_writable_folder(outputs.masks);
  require_writable_folder(outputs.folder);
  const fs::path trajectory = outputs.folder / "trajectory.txt";
  std::error_code error;
  fs::remove(trajectory, error);
  if (error) throw std::runtime_error(trajectory.string() + ": cannot be written (" + error.message() + ")");
}

}  // namespace mono_pose_tracker
