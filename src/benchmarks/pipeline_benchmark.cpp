// Measures the tracker on a sequence, offline and live at a given rate, or over a long simulated run.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

#include "io/files.h"
#include "mono_pose_tracker/io/camera_yaml.h"
#include "mono_pose_tracker/tracking/options_table.h"
#include "pipeline/benchmark_report.h"
#include "pipeline/long_runs.h"
#include "pipeline/places.h"
#include "pipeline/runs.h"
#include "simulation/simulated_sequence.h"
#include "tools/command_line.h"
#include "tools/json.h"

namespace {

using namespace mono_pose_tracker;

struct Arguments {
  std::string images, camera, config, reference, only, json, compare, simulate;
  std::vector<std::string> places;
  std::optional<std::uint64_t> seed;
  int max_frames = -1, repeat = 1;
  double rate_hz = 30, minutes = 20;
  int width = 640, height = 480;
  int place_keyframes = 3000;
  int growth = 0;
  bool unpaced = false, quiet = false;
};

using Options = std::vector<CLI::Option*>;

void exclude_each(CLI::Option* option, const Options& others) {
  for (CLI::Option* other : others) option->excludes(other);
}

// What a run on a recording takes, and no other run.
Options declare_recording(CLI::App& app, Arguments& a) {
  return {
      app.add_option("--images", a.images, "folder of images, or a list of `timestamp path` lines"),
      app.add_option("--camera", a.camera, "calibration, the YAML that camera_calibration writes"),
      app.add_option("--reference", a.reference, "the true poses (TUM file): position errors are given, too"),
      app.add_option("--max-frames", a.max_frames, "only so many images")->check(CLI::Range(1, 1000000)),
      app.add_option("--only", a.only, "offline or live [both]")->check(CLI::IsMember({"offline", "live"})),
      app.add_option("--repeat", a.repeat, "runs of each; the one with the median time is given [1]")
          ->check(CLI::Range(1, 1000000))};
}

CLI::Option* declare_simulation(CLI::App& app, Arguments& a) {
  auto* simulate =
      app.add_option("--simulate", a.simulate,
                     "room: a long live run instead of images. A hand-held camera goes round in a "
                     "simulated room, lap after lap at a wandering speed. Each of the 360 "
                     "positions of a lap is rendered once, at the beginning, and kept; a frame is "
                     "such a view rotated by a random hand motion, with new noise of 2 grey levels "
                     "(grey images). corridor: along an endless corridor without revisits")
          ->check(CLI::IsMember({"room", "corridor"}));
  app.add_option("--minutes", a.minutes, "simulated [20]")->needs(simulate)->check(CLI::Range(0.01, 1e5));
  app.add_option("--width", a.width, "of the simulated images, px [640]")
      ->needs(simulate)
      ->check(CLI::Range(80, 4000));
  app.add_option("--height", a.height, "px [480]")->needs(simulate)->check(CLI::Range(60, 4000));
  app.add_flag("--unpaced", a.unpaced,
               "each simulated frame comes when the last is done, so that none is dropped")
      ->needs(simulate);
  return simulate;
}

CLI::Option* declare_places(CLI::App& app, Arguments& a) {
  auto* places = app.add_option(
      "--places", a.places,
      "folders (images.txt, camera.yaml, groundtruth.txt, optionally masks/): accuracy and speed of place "
      "recognition among keyframes of all of them");
  app.add_option("--place-keyframes", a.place_keyframes,
                 "number of keyframes, filled up with synthetic ones [3000]")
      ->needs(places)
      ->check(CLI::Range(1, 1000000));
  return places;
}

CLI::Option* declare_growth(CLI::App& app, Arguments& a) {
  return app
      .add_option("--growth", a.growth,
                  "cost of a map that grows to so many keyframes, with synthetic features: along a "
                  "street, and before one wall where everything is covisible (a quarter of them)")
      ->check(CLI::Range(100, 100000));
}

void declare(CLI::App& app, Arguments& a) {
  const Options recording = declare_recording(app, a);
  app.add_option("--config", a.config, "tracker.yaml: options, see config/default.yaml");
  app.add_option("--seed", a.seed, "of all random choices [0]")->check(whole_number(0));
  app.add_option("--rate", a.rate_hz, "images a second of the live run [30]")->check(CLI::Range(0.1, 1000.0));
  auto* simulate = declare_simulation(app, a);
  auto* places = declare_places(app, a);
  auto* growth = declare_growth(app, a);
  for (CLI::Option* instead : {simulate, places, growth}) exclude_each(instead, recording);
  exclude_each(places, {simulate});
  exclude_each(growth, {simulate, places});
  app.add_option("--json", a.json, "write the figures to this file");
  app.add_option("--compare", a.compare, "earlier output of --json: prints the ratios now / earlier");
  app.add_flag("--quiet", a.quiet, "print errors only");
}

TrackerOptions options_of(const Arguments& a) {
  TrackerOptions options;
  if (!a.config.empty()) read_options_yaml(a.config, &options);
  if (a.seed) options.seed = *a.seed;
  options.validate();
  return options;
}

Json describe(const Arguments& a, const CameraParameters& camera, const TrackerOptions& options) {
  return {{"program", "pipeline_benchmark"},
          {"images", a.images.empty() ? a.simulate : a.images},
          {"config", a.config.empty() ? "default" : a.config},
          {"width", camera.width},
          {"height", camera.height},
          {"seed", options.seed},
          {"processors", std::thread::hardware_concurrency()}};
}

Json measure(const Arguments& a) {
  if (a.images.empty()) throw std::runtime_error("no input: give --images, or --simulate room");
  if (a.camera.empty()) {
    throw std::runtime_error("no calibration: give --camera, the YAML that camera_calibration writes");
  }
  const TrackerOptions options = options_of(a);
  const CameraParameters camera = read_camera_yaml(a.camera);
  const std::vector<StampedPose> reference =
      a.reference.empty() ? std::vector<StampedPose>() : read_tum(a.reference);
  const DecodedSequence sequence = decode_images(a.images, a.max_frames, camera);
  for (const std::string& problem : sequence.problems) std::fprintf(stderr, "%s\n", problem.c_str());
  Json result = describe(a, camera, options);
  const RunInput input{sequence, camera, options, reference};
  std::vector<Json> offline, live;
  for (int i = 0; i < a.repeat; ++i) {
    std::vector<StampedPose> offline_poses;
    if (a.only != "live") offline.push_back(run_offline(input, &offline_poses));
    if (a.only != "offline") live.push_back(run_live(input, a.rate_hz, offline_poses));
  }
  if (!offline.empty()) result["offline"] = median_run(std::move(offline));
  if (!live.empty()) result["live"] = median_run(std::move(live));
  if (!a.quiet) std::fputs(benchmark_table(result).c_str(), stdout);
  return result;
}

Json soak(const Arguments& a) {
  const TrackerOptions options = options_of(a);
  SoakOptions soak;
  soak.room.camera = default_camera(SceneKind::kRoom, a.width, a.height);
  soak.room.rate_hz = a.rate_hz;
  soak.corridor = a.simulate == "corridor";
  soak.minutes = a.minutes;
  soak.paced = !a.unpaced;
  Json result = describe(a, soak.room.camera, options);
  const auto say = [&](const std::string& line) {
    if (a.quiet) return;
    std::fputs(line.c_str(), stdout);
    std::fflush(stdout);
  };
  result["soak"] = run_soak(soak, options, say);
  say(soak_ratios(result["soak"]));
  return result;
}

Json study_places(const Arguments& a) {
  const TrackerOptions options = options_of(a);
  PlaceStudyOptions study;
  study.folders = a.places;
  study.keyframes = a.place_keyframes;
  Json result = {{"program", "pipeline_benchmark"},
                 {"config", a.config.empty() ? "default" : a.config},
                 {"places", run_place_study(study, options)}};
  if (!a.quiet) std::fputs(place_table(result["places"]).c_str(), stdout);
  return result;
}

Json study_growth(const Arguments& a) {
  Json result = {{"program", "pipeline_benchmark"},
                 {"config", a.config.empty() ? "default" : a.config},
                 {"growth", run_growth(a.growth, options_of(a))}};
  if (!a.quiet) std::fputs(growth_table(result["growth"]).c_str(), stdout);
  return result;
}

Json result_of(const Arguments& a) {
  if (a.growth > 0) return study_growth(a);
  if (!a.places.empty()) return study_places(a);
  return a.simulate.empty() ? measure(a) : soak(a);
}

void run(const Arguments& a) {
  // What cannot be compared with is found before the work.
  const Json earlier = a.compare.empty() ? Json() : read_benchmark(a.compare);
  const Json result = result_of(a);
  if (!a.json.empty()) {
    write_file_atomically(a.json, [&](std::ostream& out) { out << result.dump(2) << '\n'; });
  }
  if (!a.compare.empty()) std::printf("\n%s", comparison_table(earlier, result).c_str());
}

}  // namespace

// Options are declared before anything is caught: that fails for lack of memory only.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
  CLI::App app(
      "Measures the tracker on a sequence of images, decoded beforehand: offline (every image, the mapper "
      "inline) and live (images come at a fixed rate, the newest waits in a slot of one, the mapper on its "
      "own thread, as in the nodelet; no roscore is needed, and nothing is published). Or, with --simulate, "
      "whether the cost of a long live run grows.",
      "pipeline_benchmark");
  Arguments arguments;
  declare(app, arguments);
  return run_command_line("pipeline_benchmark", app, argc, argv, [&] {
    run(arguments);
    require_printed();
    return 0;
  });
}
