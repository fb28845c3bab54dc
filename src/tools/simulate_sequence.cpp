// Renders a sequence with exact ground truth.

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <stdexcept>

#include "command_line.h"
#include "io/files.h"
#include "io/image_coding.h"
#include "io/stamp.h"
#include "mono_pose_tracker/io/camera_yaml.h"
#include "mono_pose_tracker/io/trajectory.h"
#include "progress.h"
#include "ros/bag_writer.h"
#include "simulation/simulated_sequence.h"
#include "written_files.h"

namespace {

namespace fs = std::filesystem;
using namespace mono_pose_tracker;

struct Arguments {
  std::string scene = "head", background = "plain", shoulders = "none", bonnet = "none", lights = "camera",
              path, output;
  int width = 640, height = 480;
  double focal_px = 0, hfov_deg = 0;
  std::string distortion_model = "plumb_bob";
  std::vector<double> distortion;
  std::string bag;
  bool bag_masks = false, quiet = false;
  SequenceOptions sequence;
};

std::string image_name(int index) {
  char name[32];
  std::snprintf(name, sizeof name, "%06d.png", index);
  return name;
}

void declare_head(CLI::App& app, Arguments& a) {
  SequenceOptions& s = a.sequence;
  app.add_option("--background", a.background,
                 "background behind the head: plain (dark), textured, wall (bright, hardly any texture) or "
                 "room; the first three are static [plain]")
      ->check(CLI::IsMember({"plain", "textured", "wall", "room"}));
  app.add_option("--shoulders", a.shoulders,
                 "shoulders below the head that do not turn with it: none, still or sway [none]")
      ->check(CLI::IsMember({"none", "still", "sway"}));
  app.add_flag("--speaks", s.face.speaks, "the head's mouth opens and closes, and the skin around it moves");
  app.add_flag("--blinks", s.face.blinks, "the head's eyes blink and sometimes change their direction");
  app.add_flag("--loose-hair", s.face.loose_hair, "the head's hair has fine strands that sway independently");
  app.add_option("--shine", s.shine,
                 "strength of the reflections on head or bust, which stay in place while it turns; 0.2 skin, "
                 "1 polished [0]");
  app.add_flag(
      "--hand-held", s.hand_held,
      "the camera sways in front of head or turntable: the background moves independently of the head");
}

void declare(CLI::App& app, Arguments& a) {
  SequenceOptions& s = a.sequence;
  app.add_option("--output", a.output, "output folder (created if missing)")->required();
  app.add_option("--scene", a.scene,
                 "scene: head, turntable (with a bust), room, plane, block, eight or corridor [head]")
      ->check(CLI::IsMember({"head", "turntable", "room", "plane", "block", "eight", "corridor"}));
  declare_head(app, a);
  app.add_option("--lights", a.lights,
                 "lights of the head scene: fixed to the camera or to the object [camera]")
      ->check(CLI::IsMember({"camera", "object"}));
  app.add_option(
      "--path", a.path,
      "custom camera path: TUM lines `timestamp tx ty tz qx qy qz qw`, map_from_camera, in metres; "
      "for the head, map is the frame of the head: origin between the ears, x to its left, y down, z back");
  app.add_option("--frames", s.frames,
                 "number of images [120; block, eight, corridor: one every 0.25 m; or the whole path]")
      ->check(CLI::PositiveNumber);
  app.add_option("--lead-in", s.lead_in,
                 "number of images of the background alone before the head appears [0]")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--width", a.width, "px [640]");
  app.add_option("--height", a.height, "px [480]");
  auto* focal = app.add_option("--focal", a.focal_px,
                               "focal length, px [head and turntable 1.2 times the width, else 0.82]");
  app.add_option("--hfov", a.hfov_deg, "horizontal field of view, degrees, instead of --focal")
      ->excludes(focal);
  app.add_option("--distortion", a.distortion, "coefficients: k1,k2,p1,p2,k3 of plumb_bob")->delimiter(',');
  app.add_option("--distortion-model", a.distortion_model, "plumb_bob, rational_polynomial or equidistant")
      ->check(CLI::IsMember({"plumb_bob", "rational_polynomial", "equidistant"}));
  app.add_option("--noise", s.noise_grey_levels, "pixel noise, standard deviation in grey levels of 255 [0]");
  app.add_option("--blur", s.blur_px, "Gaussian blur, standard deviation in px [0]");
  app.add_option(
      "--rolling-shutter", s.rolling_shutter_s,
      "readout time from the first row to the last, s; the ground truth is the pose of the middle row [0]");
  app.add_option("--exposure-drift", s.exposure_drift,
                 "greatest relative change of brightness, such as 0.2 [0]");
  app.add_flag("--occluder", s.occluder, "a hand passes in front of the object (0 in the masks)");
  app.add_option("--bonnet", a.bonnet,
                 "vehicle bonnet in the lower quarter of the image, which moves with the camera (0 in the "
                 "masks): none, still or shakes [none]")
      ->check(CLI::IsMember({"none", "still", "shakes"}));
  app.add_option("--seed", s.seed, "seed of textures, path and noise [1]")->check(whole_number(0));
  app.add_option("--rate", s.rate_hz, "frames a second [30]");
  app.add_option("--first-stamp", s.first_stamp_s, "time stamp of the first image, s [1]");
  app.add_option("--samples", s.samples, "samples per pixel side [2]");
  app.add_option("--threads", s.threads,
                 "number of threads, 0: all cores [0]; the result does not depend on it");
  app.add_option("--bag", a.bag, "bag to write [sequence.bag in the output folder]");
  app.add_flag("--bag-masks", a.bag_masks, "also write the masks to the bag, on /camera/mask");
  app.add_flag("--quiet", a.quiet, "print nothing");
}

CameraParameters camera_of(const Arguments& a) {
  CameraParameters camera = default_camera(a.sequence.scene, a.width, a.height);
  if (a.hfov_deg != 0) {
    if (a.hfov_deg <= 0 || a.hfov_deg >= 180)
      throw std::invalid_argument("--hfov: expected degrees between 0 and 180");
    camera.fx = camera.fy = 0.5 * a.width / std::tan(a.hfov_deg * 3.14159265358979 / 360);
  }
  if (a.focal_px != 0) camera.fx = camera.fy = a.focal_px;
  camera.distortion_model = a.distortion_model;
  if (!a.distortion.empty()) camera.distortion = a.distortion;
  return camera;
}

void complete(Arguments& a) {
  SequenceOptions& s = a.sequence;
  static const std::map<std::string, SceneKind> kinds = {
      {"head", SceneKind::kHead},        {"turntable", SceneKind::kTurntable}, {"room", SceneKind::kRoom},
      {"plane", SceneKind::kPlane},      {"block", SceneKind::kBlock},         {"eight", SceneKind::kEight},
      {"corridor", SceneKind::kCorridor}};
  s.scene = kinds.at(a.scene);
  static const std::map<std::string, BackgroundKind> backgrounds = {{"plain", BackgroundKind::kPlain},
                                                                    {"textured", BackgroundKind::kTextured},
                                                                    {"wall", BackgroundKind::kWall},
                                                                    {"room", BackgroundKind::kRoom}};
  static const std::map<std::string, ShouldersKind> shoulders = {
      {"none", ShouldersKind::kNone}, {"still", ShouldersKind::kStill}, {"sway", ShouldersKind::kSway}};
  s.background = backgrounds.at(a.background);
  s.shoulders = shoulders.at(a.shoulders);
  static const std::map<std::string, BonnetKind> bonnets = {
      {"none", BonnetKind::kNone}, {"still", BonnetKind::kStill}, {"shakes", BonnetKind::kShakes}};
  s.bonnet = bonnets.at(a.bonnet);
  s.lights_move_with_camera = a.lights == "camera";
  s.camera = camera_of(a);
  if (a.path.empty()) return;
  s.path = read_tum(a.path);
  if (s.path.empty()) throw std::invalid_argument(a.path + ": contains no pose, expected TUM lines");
}

std::string bag_of(const Arguments& a) {
  return a.bag.empty() ? (fs::path(a.output) / "sequence.bag").string() : a.bag;
}

// Before anything is made.
void check_outputs(const Arguments& a, const SimulatedSequence& sequence) {
  for (const int frame : {0, sequence.size() - 1}) {
    require_message_stamp("image " + std::to_string(frame + 1) + " of " + std::to_string(sequence.size()),
                          sequence.stamp(frame));
  }
  Inputs inputs;
  inputs.add(a.path);
  WrittenFiles files(inputs);
  const fs::path folder(a.output);
  for (const char* name : {"camera.yaml", "images.txt", "groundtruth.txt"}) {
    files.add(folder / name, "--output");
  }
  for (int i = 0; i < sequence.size(); ++i) {
    for (const char* kind : {"images", "masks"}) files.add(folder / kind / image_name(i), "--output");
  }
  files.add(bag_of(a), "--bag");
  require_regular_file(bag_of(a));
}

void render_to(const Arguments& a, const SimulatedSequence& sequence) {
  check_outputs(a, sequence);
  const fs::path folder(a.output);
  make_folder(folder / "images");
  make_folder(folder / "masks");
  write_camera_yaml((folder / "camera.yaml").string(), "simulated", sequence.camera().parameters());
  PartFile part(followed(bag_of(a)));  // half a bag is none; a link stays, what it names is written
  BagWriter bag(part.name(), sequence.camera().parameters());
  std::string list;
  ProgressBar progress(sequence.size(), a.quiet);
  for (int i = 0; i < sequence.size(); ++i) {
    const SimulatedFrame frame = sequence.render(i);
    const std::string name = image_name(i);
    write_image(folder / "images" / name, frame.image);
    write_image(folder / "masks" / name, frame.mask);
    bag.write(frame.stamp_ns, frame.image);
    if (a.bag_masks) bag.write_mask(frame.stamp_ns, frame.mask);
    list += format_stamp(frame.stamp_ns) + " images/" + name + "\n";
    progress.advance();
  }
  bag.close();
  part.put_in_place();
  write_file_atomically((folder / "images.txt").string(), [&](std::ostream& out) { out << list; });
  write_tum((folder / "groundtruth.txt").string(), sequence.path());
}

}  // namespace

// Options are declared before anything is caught: that fails for lack of memory only.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
  Arguments a;
  CLI::App app("Renders a sequence with exact ground truth: images, masks, camera.yaml, groundtruth.txt.");
  declare(app, a);
  return run_command_line("simulate_sequence", app, argc, argv, [&] {
    complete(a);
    render_to(a, SimulatedSequence(a.sequence));
    return 0;
  });
}
