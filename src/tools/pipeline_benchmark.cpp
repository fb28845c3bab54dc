// Measures the tracker on a sequence: offline, and live at a given rate.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <thread>

#include "mono_pose_tracker/io/atomic_file.h"
#include "mono_pose_tracker/io/camera_yaml.h"
#include "mono_pose_tracker/tracking/options_table.h"
#include "pipeline/benchmark_report.h"
#include "pipeline/runs.h"

namespace {

using namespace mono_pose_tracker;

struct Arguments {
  std::string images, camera, config, reference, only, json, compare;
  std::optional<std::uint64_t> seed;
  int max_frames = -1, repeat = 1;
  double rate_hz = 30;
  bool quiet = false;
};

void declare(CLI::App& app, Arguments& a) {
  app.add_option("--images", a.images, "folder of images, or a list of `timestamp path` lines")->required();
  app.add_option("--camera", a.camera, "calibration, the YAML that camera_calibration writes")->required();
  app.add_option("--config", a.config, "tracker.yaml: options, see config/default.yaml");
  app.add_option("--reference", a.reference, "the true poses (TUM file): position errors are given, too");
  app.add_option("--seed", a.seed, "of all random choices [0]");
  app.add_option("--max-frames", a.max_frames, "only so many images")->check(CLI::Range(1, 1000000));
  app.add_option("--rate", a.rate_hz, "images a second of the live run [30]")->check(CLI::Range(0.1, 1000.0));
  app.add_option("--only", a.only, "offline or live [both]")->check(CLI::IsMember({"offline", "live"}));
  app.add_option("--repeat", a.repeat, "runs of each; the one with the median time is given [1]")
      ->check(CLI::Range(1, 1000000));
  app.add_option("--json", a.json, "write the figures to this file");
  app.add_option("--compare", a.compare, "what --json wrote earlier: ratios now / earlier are printed");
  app.add_flag("--quiet", a.quiet, "say nothing but errors");
}

nlohmann::ordered_json measure(const Arguments& a) {
  TrackerOptions options;
  if (!a.config.empty()) read_options_yaml(a.config, &options);
  if (a.seed) options.seed = *a.seed;
  const CameraParameters camera = read_camera_yaml(a.camera);
  const std::vector<StampedPose> reference =
      a.reference.empty() ? std::vector<StampedPose>() : read_tum(a.reference);
  const DecodedSequence sequence = decode_images(a.images, a.max_frames, camera);
  for (const std::string& problem : sequence.problems) std::fprintf(stderr, "%s\n", problem.c_str());
  nlohmann::ordered_json result = {{"program", "pipeline_benchmark"},
                                   {"images", a.images},
                                   {"config", a.config.empty() ? "default" : a.config},
                                   {"width", camera.width},
                                   {"height", camera.height},
                                   {"seed", options.seed},
                                   {"processors", std::thread::hardware_concurrency()}};
  const RunInput input{sequence, camera, options, reference};
  std::vector<nlohmann::ordered_json> offline, live;
  for (int i = 0; i < a.repeat; ++i) {
    if (a.only != "live") offline.push_back(run_offline(input));
    if (a.only != "offline") live.push_back(run_live(input, a.rate_hz));
  }
  if (!offline.empty()) result["offline"] = median_run(std::move(offline));
  if (!live.empty()) result["live"] = median_run(std::move(live));
  return result;
}

void run(const Arguments& a) {
  // What cannot be compared with is found before the work.
  const nlohmann::ordered_json earlier =
      a.compare.empty() ? nlohmann::ordered_json() : read_benchmark(a.compare);
  const nlohmann::ordered_json result = measure(a);
  if (!a.json.empty()) {
    write_file_atomically(a.json, [&](std::ostream& out) { out << result.dump(2) << '\n'; });
  }
  if (!a.quiet) std::fputs(benchmark_table(result).c_str(), stdout);
  if (!a.compare.empty()) std::printf("\n%s", comparison_table(earlier, result).c_str());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Measures the tracker on a sequence of images, decoded beforehand: offline (every image, the mapper "
      "inline) and live (images come at a fixed rate, the newest waits in a slot of one, the mapper on its "
      "own thread, as in the nodelet; no roscore is needed, and nothing is published).",
      "pipeline_benchmark");
  Arguments arguments;
  declare(app, arguments);
  try {
    app.parse(argc, argv);
    run(arguments);
    return 0;
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);
    std::fprintf(stderr, "pipeline_benchmark: %s\n", e.what());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "pipeline_benchmark: %s\n", e.what());
  }
  return 2;
}
