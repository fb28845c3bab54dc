// Writes a video, a folder or a list of images as a bag, stamped as track_sequence stamps them.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <stdexcept>

#include "command_line.h"
#include "io/files.h"
#include "io/image_source.h"
#include "mono_pose_tracker/io/camera_yaml.h"
#include "progress.h"
#include "ros/bag_writer.h"
#include "written_files.h"

namespace {

namespace fs = std::filesystem;
using namespace mono_pose_tracker;

struct Arguments {
  std::string recording, bag, camera;
  int jpeg_quality = 0;
  bool compressed = false, quiet = false;
};

void declare(CLI::App& app, Arguments& a) {
  app.add_option("recording", a.recording,
                 "video file, folder of images, or list of `timestamp path` lines; an images.txt in the "
                 "folder is used as the list")
      ->required();
  app.add_option("bag", a.bag, "bag to write")->required();
  app.add_option("--camera", a.camera, "calibration, YAML of camera_calibration [no CameraInfo]");
  app.add_flag("--compressed", a.compressed, "write JPEG images, on /camera/image_raw/compressed");
  app.add_option("--quality", a.jpeg_quality, "JPEG quality of --compressed [95]")->check(CLI::Range(1, 100));
  app.add_flag("--quiet", a.quiet, "print errors only");
}

// The list or folder of images that the recording is; of a video none.
std::string images_of(const std::string& path) {
  const fs::path list = fs::path(path) / "images.txt";
  if (fs::is_regular_file(list)) return list.string();
  return fs::is_directory(path) || fs::path(path).extension() == ".txt" ||
                 fs::path(path).extension() == ".csv"
             ? path
             : "";
}

// What is known before any image is read.
void check(const Arguments& a, const std::string& images, const std::string& written) {
  Inputs inputs;
  for (const std::string& path : {a.recording, a.camera, images}) inputs.add(path);
  if (!images.empty()) {
    for (const ImageFile& image : image_files(images)) {
      inputs.add(image.path);
      require_message_stamp(image.path, image.stamp_ns);
    }
  }
  inputs.refuse_to_overwrite(written);
}

int write_images(const Arguments& a, const std::string& path, ImageSource& source,
                 const std::optional<CameraParameters>& camera) {
  BagWriter bag(path, camera, a.jpeg_quality);
  ProgressBar progress(source.size(), a.quiet);
  int written = 0;
  for (SourceImage image = source.next(); image.kind != SourceImage::Kind::kEnd; image = source.next()) {
    if (signals_caught > 0) throw std::runtime_error("interrupted");
    progress.advance();
    if (image.kind == SourceImage::Kind::kSkipped) {
      std::fprintf(stderr, "%s\n", one_line(image.problem).c_str());
      continue;
    }
    if (camera && (image.image.cols != camera->width || image.image.rows != camera->height)) {
      throw std::runtime_error(image.name + ": is " + std::to_string(image.image.cols) + "x" +
                               std::to_string(image.image.rows) + ", the calibration is for " +
                               std::to_string(camera->width) + "x" + std::to_string(camera->height));
    }
    bag.write(image.stamp_ns, image.image);
    ++written;
  }
  bag.close();
  return written;
}

int run(Arguments a) {
  if (a.compressed && a.jpeg_quality == 0) a.jpeg_quality = 95;
  if (!a.compressed) a.jpeg_quality = 0;
  std::optional<CameraParameters> camera;
  if (!a.camera.empty()) camera = read_camera_yaml(a.camera);
  const std::string images = images_of(a.recording);
  const std::unique_ptr<ImageSource> source = images.empty() ? open_video(a.recording) : open_images(images);
  require_regular_file(a.bag);
  // A link stays, what it names is written.
  const std::string path = fs::is_symlink(a.bag) ? followed(a.bag) : a.bag;
  check(a, images, path);
  end_on_signals();
  PartFile part(path);  // half a bag is none
  const int written = write_images(a, part.name(), *source, camera);
  if (written == 0) throw std::runtime_error(a.recording + ": no image in it could be read");
  part.put_in_place();
  if (!a.quiet) {
    std::printf("%d images in %s%s\n", written, path.c_str(),
                camera ? "" : ", without camera_info (--camera writes it)");
  }
  return 0;
}

}  // namespace

// Options are declared before anything is caught: that fails for lack of memory only.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
  CLI::App app(
      "Writes a video, a folder or a list of images as a bag: /camera/image_raw and /camera/camera_info.",
      "recording_to_bag");
  Arguments arguments;
  declare(app, arguments);
  return end_status(run_command_line("recording_to_bag", app, argc, argv, [&] { return run(arguments); }));
}
