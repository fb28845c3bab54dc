#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "camera/camera_parameters.h"
#include "command_line.h"
#include "common/threads.h"

namespace mono_pose_tracker {

/// As the command line has them; those that were not given are empty.
struct Arguments {
  std::string images, video, image_topic, camera_info_topic;
  std::vector<std::string> bags;
  std::string rectified = "auto", grey_levels = "auto";
  std::string camera, config, masks, output, write_masks, reference, align, map, save_map, save_view_graph;
  bool localize_only = false;
  std::string report = "summary";
  std::optional<double> hfov;
  bool undistorted = false, write_frames = false, refine_camera = false;
  std::optional<std::uint64_t> seed;
  std::int64_t max_frames = -1;
  int threads = processors();
  std::size_t feature_memory_mb = 64;
  bool quiet = false;
};

inline void declare(CLI::App& app, Arguments& a) {
  auto* images =
      app.add_option("--images", a.images, "folder of images, or a list of `timestamp path` lines");
  auto* video = app.add_option("--video", a.video, "video file")->excludes(images);
  auto* bag =
      app.add_option("--bag", a.bags,
                     "bag file of ROS 1; several, or a pattern (walk_*.bag), are one recording. Or one "
                     "recording of ROS 2: its folder, .db3 or .mcap file")
          ->excludes(images)
          ->excludes(video);
  app.add_option("--image-topic", a.image_topic, "image topic of the bag [its only one]")->needs(bag);
  app.add_option("--camera-info-topic", a.camera_info_topic,
                 "CameraInfo topic of the bag [camera_info in the namespace of the images]")
      ->needs(bag);
  auto* camera =
      app.add_option("--camera", a.camera, "calibration, the YAML file that camera_calibration writes");
  app.add_option(
      "--grey-levels", a.grey_levels,
      "for images of 16 bits: number of bits used (8 to 16), the values of black and white (7000:9000), or "
      "auto, by the first images [auto]");
  app.add_option(
         "--rectified", a.rectified,
         "whether the images are rectified (then P of the calibration is used, without distortion): true, "
         "false, or auto, by the bag's topic (image_rect...) [auto]")
      ->check(CLI::IsMember(kRectifiedSettings));
  app.add_option("--hfov", a.hfov,
                 "instead of a calibration: guessed horizontal field of view, degrees; refined as by "
                 "--refine-camera, except with --map")
      ->excludes(camera)
      ->check(number_between(kMinHfovDeg, kMaxHfovDeg));
  app.add_flag(
      "--refine-camera", a.refine_camera,
      "refine focal length, principal point and distortion as far as the motion determines them: the "
      "recording is tracked several times; writes camera_refined.yaml");
  app.add_option("--output", a.output, "output folder (created if missing)")->required();
  app.add_option("--config", a.config, "tracker.yaml: options, see config/default.yaml");
  app.add_option("--masks", a.masks, "folder of masks with the base names of the images, 0 = ignore");
  app.add_option("--write-masks", a.write_masks,
                 "folder to write the masks of the object to, with its outline where no masks are given");
  app.add_flag(
      "--undistorted", a.undistorted,
      "write undistorted images and masks, with the model for dense reconstruction (COLMAP), Gaussian "
      "splatting and NeRF (sparse/0, transforms.json), to the subfolder undistorted of the output");
  app.add_flag("--write-frames", a.write_frames,
               "write the images of a video or bag to the subfolder frames of the output, with the names of "
               "the COLMAP model")
      ->excludes(images);
  app.add_option("--reference", a.reference, "true trajectory (TUM lines), drawn into overview.png");
  app.add_option(
      "--align", a.align,
      "measured positions of the camera, TUM lines or lines `image-name latitude longitude altitude`: "
      "transform all results to the frame of the positions, in metres; outliers are detected");
  auto* map = app.add_option("--map", a.map, "continue in a saved map, also of another camera")
                  ->excludes(app.get_option("--refine-camera"));
  auto* localize = app.add_flag("--localize-only", a.localize_only,
                                "poses in the saved map only: it is not changed, and no new map is started")
                       ->needs(map);
  app.add_option("--save-map", a.save_map, "file to write the map to, for a later run with --map")
      ->excludes(localize);
  app.add_option("--save-view-graph", a.save_view_graph,
                 "file to write the two-view geometries to, as JSON lines");
  app.add_option("--report", a.report,
                 "summary, or full: also write view_graph.png, the image pairs by the share of their matches "
                 "explained by the map [summary]")
      ->check(CLI::IsMember({"summary", "full"}));
  app.add_option("--seed", a.seed, "seed of all random choices [0]")->check(whole_number(0));
  app.add_option("--threads", a.threads,
                 "number of threads, which does not change the results [all cores]; sift/num_threads and "
                 "bundle/num_threads are ignored")
      ->check(CLI::Range(1, 256));
  app.add_option("--feature-memory", a.feature_memory_mb,
                 "MB of memory for features of images that may be processed again; more are stored in a "
                 "temporary file in the output folder [64]")
      ->check(CLI::Range(0, 1 << 20));
  app.add_option("--max-frames", a.max_frames, "largest number of images to process")->check(whole_number(1));
  app.add_flag("--quiet", a.quiet, "print errors and warnings only");
}

}  // namespace mono_pose_tracker
