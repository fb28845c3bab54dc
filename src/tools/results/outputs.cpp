#include "outputs.h"

#include <map>
#include <set>
#include <stdexcept>
#include <string>

#include "../written_files.h"
#include "common/text.h"
#include "io/files.h"

namespace mono_pose_tracker {

namespace fs = std::filesystem;

namespace {

// Number of the map in the folder: 2, 3, ...; 0: none.
int map_number(const fs::directory_entry& folder) {
  const std::string name = folder.path().filename().string();
  int number = 0;
  std::error_code error;
  const bool is_of_map =
      name.rfind("map_", 0) == 0 && parse_decimal(name.substr(4), &number) && folder.is_directory(error);
  return is_of_map && number >= 2 ? number : 0;
}

// Of the maps but the largest, by number.
std::map<int, fs::path> further_map_folders(const fs::path& output) {
  std::map<int, fs::path> folders;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(output, error)) {
    if (const int number = map_number(entry)) folders[number] = entry.path();
  }
  return folders;
}

// Of the largest map, and of the others where they are there: what is read can be in no other.
std::vector<fs::path> map_folders(const fs::path& output) {
  std::vector<fs::path> folders = {output};
  for (const auto& entry : further_map_folders(output)) folders.push_back(entry.second);
  return folders;
}

void remove_old(const fs::path& file) {
  std::error_code error;
  fs::remove(file, error);
  if (error) throw std::runtime_error(file.string() + ": cannot be written (" + error.message() + ")");
}

std::vector<fs::path> colmap_files(const fs::path& folder) {
  return {folder / "cameras.txt", folder / "images.txt", folder / "points3D.txt"};
}

// The files in the output folder itself, written in any case.
std::vector<fs::path> result_files(const Outputs& outputs) {
  std::vector<fs::path> files;
  for (const char* name : {"trajectory.txt", "trajectory_live.txt", "points.ply", "overview.png",
                           "overview.html", "report.json"}) {
    files.push_back(outputs.folder / name);
  }
  if (outputs.refined_camera) files.push_back(outputs.folder / "camera_refined.yaml");
  if (outputs.view_graph_picture) files.push_back(outputs.folder / "view_graph.png");
  return files;
}

void add_results(const Outputs& outputs, WrittenFiles* files) {
  for (const fs::path& file : result_files(outputs)) files->add(file, "--output");
  for (const fs::path& folder : map_folders(outputs.folder)) {
    for (const char* name : {"trajectory.txt", "points.ply", "overview.png", "overview.html"}) {
      files->add(folder / name, "--output");
    }
    for (const fs::path& file : colmap_files(folder / "colmap")) files->add(file, "--output");
  }
}

void add_undistorted(const fs::path& folder, const std::vector<std::string>& names, WrittenFiles* files) {
  for (const std::string& name : names) {
    files->add(folder / "images" / name, "--undistorted");
    files->add(folder / "masks" / (name + ".png"), "--undistorted");
  }
  for (const fs::path& file : colmap_files(folder / "sparse")) files->add(file, "--undistorted");
  for (const fs::path& file : colmap_files(folder / "sparse" / "0")) {
    files->add(file, "--undistorted");
    files->add(fs::path(file).replace_extension(".bin"), "--undistorted");
  }
  for (const char* name : {"transforms.json", "sparse_pc.ply"}) files->add(folder / name, "--undistorted");
  for (const char* name : {"patch-match.cfg", "fusion.cfg"}) {
    files->add(folder / "stereo" / name, "--undistorted");
  }
}

void add_written_masks(const fs::path& folder, const std::vector<std::string>& names, WrittenFiles* files) {
  for (const std::string& name : names) {
    files->add(folder / fs::path(name).replace_extension(".png"), "--write-masks");
    files->add(folder / (name + ".png"), "--write-masks");
  }
}

std::vector<std::string> names_of(const std::vector<ImageFile>& images) {
  std::vector<std::string> names;
  for (const ImageFile& image : images) names.push_back(image.name);
  if (images.empty()) names = {"000000.png"};  // where one frame goes the others go
  return names;
}

}  // namespace

void add_masks(const fs::path& folder, const std::vector<ImageFile>& images, Inputs* inputs) {
  inputs->add(folder);
  std::set<std::string> wanted;
  for (const std::string& name : names_of(images)) {
    const fs::path stem = fs::path(name).replace_extension();
    wanted.insert({stem.string(), stem.filename().string()});
  }
  std::error_code error;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    fs::path name = entry->path().lexically_relative(folder);
    if (wanted.count(name.replace_extension().string()) > 0) inputs->add(entry->path());
  }
}

void refuse_to_overwrite(const Inputs& inputs, const std::vector<ImageFile>& images, const Outputs& outputs) {
  const std::vector<std::string> names = names_of(images);
  WrittenFiles files(inputs);
  add_results(outputs, &files);
  files.add(outputs.map, "--save-map");
  files.add(outputs.view_graph, "--save-view-graph");
  if (outputs.frames) {
    for (const std::string& name : names) files.add(outputs.folder / "frames" / name, "--write-frames");
  }
  if (outputs.undistorted) add_undistorted(outputs.folder / "undistorted", names, &files);
  inputs.refuse_to_overwrite(outputs.masks);
  if (!outputs.masks.empty()) add_written_masks(outputs.masks, names, &files);
}

void refuse_among_images(const fs::path& images, const Outputs& outputs) {
  if (images.empty()) return;
  const std::string read = followed(images);
  for (const fs::path& folder : map_folders(outputs.folder)) {
    if (followed(folder) != read) continue;
    throw std::runtime_error(folder.string() +
                             ": this folder contains the input images, and images of the results would be "
                             "mistaken for input: expected another folder as --output");
  }
}

void require_writable(const Outputs& outputs) {
  for (const fs::path& file : result_files(outputs)) require_regular_file(file.string());
  if (!outputs.map.empty()) require_writable_file(outputs.map.string());
  if (!outputs.view_graph.empty()) require_writable_file(outputs.view_graph.string());
  if (!outputs.masks.empty()) require_writable_folder(outputs.masks.string());
  require_writable_folder(outputs.folder.string());
  remove_old(outputs.folder / "trajectory_live.txt");
  for (const fs::path& folder : map_folders(outputs.folder)) remove_old(folder / "trajectory.txt");
}

std::vector<fs::path> earlier_files(const Outputs& outputs, const fs::path& camera, std::size_t maps) {
  std::vector<fs::path> earlier;
  const auto add = [&](const fs::path& path, bool is_written) {
    std::error_code none;
    if (is_written || !fs::exists(path, none) || fs::equivalent(path, camera, none)) return;
    earlier.push_back(path);
  };
  for (const char* name : {"points.ply", "overview.png", "overview.html", "colmap"})
    add(outputs.folder / name, maps > 0);
  add(outputs.folder / "camera_refined.yaml", outputs.refined_camera);
  add(outputs.folder / "view_graph.png", maps > 0 && outputs.view_graph_picture);
  add(outputs.folder / "undistorted", maps > 0 && outputs.undistorted);
  add(outputs.folder / "frames", outputs.frames);
  for (const auto& [number, folder] : further_map_folders(outputs.folder)) {
    add(folder, static_cast<std::size_t>(number) <= maps);
  }
  return earlier;
}

}  // namespace mono_pose_tracker
