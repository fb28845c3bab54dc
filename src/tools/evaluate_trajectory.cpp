#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "command_line.h"
#include "mono_pose_tracker/evaluation/trajectory_error.h"
#include "mono_pose_tracker/evaluation/trajectory_plot.h"
#include "mono_pose_tracker/io/atomic_file.h"
#include "mono_pose_tracker/io/trajectory.h"

using namespace mono_pose_tracker;

namespace {

struct Arguments {
  std::string reference, estimate, json, plot;
  double max_difference = 0.01;
};

void print_table(const TrajectoryError& e) {
  std::printf("frames          %d matched, %d in the reference\n", e.frames_matched, e.frames_reference);
  std::printf("scale           %.6g (reference / estimate)\n", e.reference_from_estimate.scale);
  std::printf("position        rmse %.6g   median %.6g   max %.6g\n", e.position_rmse, e.position_median,
              e.position_max);
  std::printf("                rmse is %.4f %% of the path of %.6g\n", e.position_rmse_percent,
              e.path_length);
  std::printf("rotation        median %.4f deg   max %.4f deg\n", e.rotation_median_deg, e.rotation_max_deg);
  std::printf("frame to frame  rotation median %.4f deg   direction median %.4f deg\n",
              e.relative_rotation_median_deg, e.relative_direction_median_deg);
}

nlohmann::ordered_json to_json(const TrajectoryError& e) {
  return {{"frames_reference", e.frames_reference},
          {"frames_matched", e.frames_matched},
          {"scale", e.reference_from_estimate.scale},
          {"position_rmse", e.position_rmse},
          {"position_median", e.position_median},
          {"position_max", e.position_max},
          {"path_length", e.path_length},
          {"position_rmse_percent", e.position_rmse_percent},
          {"rotation_median_deg", e.rotation_median_deg},
          {"rotation_max_deg", e.rotation_max_deg},
          {"relative_rotation_median_deg", e.relative_rotation_median_deg},
          {"relative_direction_median_deg", e.relative_direction_median_deg}};
}

void run(const Arguments& arguments) {
  const std::vector<StampedPose> reference = read_tum(arguments.reference);
  const std::vector<StampedPose> estimate = read_tum(arguments.estimate);
  const TrajectoryError error =
      evaluate_trajectory(reference, estimate, std::llround(arguments.max_difference * 1e9));
  print_table(error);
  if (!arguments.json.empty()) {
    write_file_atomically(arguments.json, [&](std::ostream& out) { out << to_json(error).dump(2) << '\n'; });
  }
  if (!arguments.plot.empty()) write_trajectory_plot(arguments.plot, error);
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app(
      "Compares an estimated trajectory with a reference, both TUM files, after a similarity alignment.");
  app.add_option("--reference", arguments.reference, "the true poses (TUM file)")->required();
  app.add_option("--estimate", arguments.estimate, "the poses to judge (TUM file)")->required();
  app.add_option("--max-difference", arguments.max_difference,
                 "largest difference in s between stamps of one frame")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--json", arguments.json, "write the figures to this file");
  app.add_option("--plot", arguments.plot, "draw both trajectories and the error over time (png, jpg)");
  return run_command_line("evaluate_trajectory", app, argc, argv, [&] {
    run(arguments);
    return 0;
  });
}
