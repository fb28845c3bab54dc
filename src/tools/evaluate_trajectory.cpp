#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "command_line.h"
#include "evaluation/trajectory_plot.h"
#include "io/files.h"
#include "json.h"
#include "mono_pose_tracker/evaluation/trajectory_error.h"
#include "mono_pose_tracker/io/trajectory.h"
#include "viewer/scene_page.h"
#include "written_files.h"

using namespace mono_pose_tracker;

namespace {

struct Arguments {
  std::string reference, estimate, json, plot, html, align = "sim3", delta = "1";
  double max_difference = 0.01;
};

/// "10": frames; "1.5m": metres, or whatever the reference's unit is.
PoseDelta parse_delta(const std::string& text) {
  const std::runtime_error problem(
      "--delta is " + text + ": expected a number of frames such as 10, or metres of path such as 1.5m");
  PoseDelta delta;
  std::size_t read = 0;
  try {
    delta.size = std::stod(text, &read);
  } catch (const std::exception&) {
    throw problem;
  }
  const std::string unit = text.substr(read);
  if (unit == "m") delta.unit = PoseDelta::Unit::kLength;
  const bool whole = unit == "m" || delta.size == std::floor(delta.size);
  if ((!unit.empty() && unit != "m") || !whole || !(delta.size > 0 && delta.size < 1e9)) throw problem;
  return delta;
}

/// A map of the estimate with its error, or the reason why there is none.
struct EvaluatedMap {
  std::size_t frames = 0;
  std::optional<TrajectoryError> error;
  std::string problem;
};

std::vector<EvaluatedMap> evaluate(const std::vector<StampedPose>& reference,
                                   const std::vector<std::vector<StampedPose>>& maps,
                                   const EvaluationOptions& options) {
  std::vector<EvaluatedMap> results;
  for (const std::vector<StampedPose>& poses : maps) {
    EvaluatedMap map;
    map.frames = poses.size();
    try {
      map.error = evaluate_trajectory(reference, poses, options);
    } catch (const std::runtime_error& e) {
      if (maps.size() == 1) throw;
      map.problem = e.what();
    }
    results.push_back(std::move(map));
  }
  return results;
}

/// The map with poses of the most reference frames.
const EvaluatedMap& main_map(const std::vector<EvaluatedMap>& maps) {
  const auto matched = [](const EvaluatedMap& map) { return map.error ? map.error->frames_matched : -1; };
  return *std::max_element(maps.begin(), maps.end(), [&](const EvaluatedMap& a, const EvaluatedMap& b) {
    return matched(a) < matched(b);
  });
}

void print_table(const TrajectoryError& e, const Arguments& arguments) {
  std::printf("frames          %d matched, %d in the reference\n", e.frames_matched, e.frames_reference);
  std::printf("scale           %.6g (reference / estimate)%s\n", e.reference_from_estimate.scale,
              arguments.align == "se3" ? ", not sought" : "");
  std::printf("ATE             rmse %.6g   median %.6g   max %.6g\n", e.position_rmse, e.position_median,
              e.position_max);
  std::printf("                rmse is %.4f %% of the path of %.6g\n", e.position_rmse_percent,
              e.path_length);
  std::printf("rotation        median %.4f deg   max %.4f deg\n", e.rotation_median_deg, e.rotation_max_deg);
  const char* const unit = arguments.delta.back() == 'm' ? "" : " frames";
  if (e.rpe_pairs == 0) {
    std::printf("RPE             over %s%s: no pairs\n", arguments.delta.c_str(), unit);
  } else {
    std::printf("RPE             over %s%s: translation rmse %.6g   rotation rmse %.4f deg   (%d pairs)\n",
                arguments.delta.c_str(), unit, e.rpe_translation_rmse, e.rpe_rotation_rmse_deg, e.rpe_pairs);
  }
  std::printf("drift           translation %.4f %%   rotation %.4f deg per unit of path\n",
              e.drift_translation_percent, e.drift_rotation_deg_per_length);
  if (e.scale_drift_percent) {
    std::printf("scale drift     %+.3f %% from the first to the last quarter\n", *e.scale_drift_percent);
  }
  std::printf("frame to frame  rotation median %.4f deg   direction median %.4f deg\n",
              e.relative_rotation_median_deg, e.relative_direction_median_deg);
}

Json to_json(const TrajectoryError& e, const Arguments& arguments) {
  Json json = {{"frames_reference", e.frames_reference},
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
               {"relative_direction_median_deg", e.relative_direction_median_deg},
               {"align", arguments.align},
               {"ate_rmse", e.position_rmse},
               {"rpe_delta", arguments.delta},
               {"rpe_pairs", e.rpe_pairs},
               {"rpe_translation_rmse", nullptr},
               {"rpe_rotation_rmse_deg", nullptr},
               {"drift_translation_percent", e.drift_translation_percent},
               {"drift_rotation_deg_per_length", e.drift_rotation_deg_per_length},
               {"scale_drift_percent", nullptr}};
  if (e.rpe_pairs > 0) {
    json["rpe_translation_rmse"] = e.rpe_translation_rmse;
    json["rpe_rotation_rmse_deg"] = e.rpe_rotation_rmse_deg;
  }
  if (e.scale_drift_percent) json["scale_drift_percent"] = *e.scale_drift_percent;
  return json;
}

Json to_json(const std::vector<EvaluatedMap>& maps, const Arguments& arguments) {
  Json json = to_json(*main_map(maps).error, arguments);
  Json epochs = Json::array();
  for (const EvaluatedMap& map : maps) {
    Json epoch = {{"frames", map.frames}};
    if (map.error) {
      epoch.update(to_json(*map.error, arguments));
    } else {
      epoch["problem"] = map.problem;
    }
    epochs.push_back(std::move(epoch));
  }
  json["epochs"] = std::move(epochs);
  return json;
}

void print(const std::vector<EvaluatedMap>& maps, const Arguments& arguments) {
  for (std::size_t i = 0; i < maps.size() && maps.size() > 1; ++i) {
    std::printf("map %zu of %zu, aligned separately: %zu poses\n", i + 1, maps.size(), maps[i].frames);
    if (maps[i].error) {
      print_table(*maps[i].error, arguments);
    } else {
      std::printf("%s\n", maps[i].problem.c_str());
    }
    std::printf("\n");
  }
  if (maps.size() > 1) std::printf("the map with the most registered frames:\n");
  print_table(*main_map(maps).error, arguments);
}

// Stamps of different clocks (those of a video begin at 0) may overlap in part; the comparison is then wrong.
void tell_of_unmatched(const EvaluatedMap& map) {
  constexpr double kFew = 0.8;  // a reference often begins later, or ends before
  if (map.error->frames_matched >= kFew * static_cast<double>(map.frames)) return;
  std::fprintf(stderr,
               "only %d of %zu estimated poses have a reference pose near in time: do both files use the "
               "same clock?\n",
               map.error->frames_matched, map.frames);
}

void run(const Arguments& arguments) {
  EvaluationOptions options;
  options.max_difference_ns = std::llround(arguments.max_difference * 1e9);
  options.alignment = arguments.align == "se3" ? Alignment::kSe3 : Alignment::kSim3;
  options.delta = parse_delta(arguments.delta);
  Inputs inputs;
  inputs.add(arguments.reference);
  inputs.add(arguments.estimate);
  WrittenFiles files(inputs);
  files.add(arguments.json, "--json");
  files.add(arguments.plot, "--plot");
  files.add(arguments.html, "--html");
  const std::vector<StampedPose> reference = read_tum(arguments.reference);
  std::vector<std::vector<StampedPose>> estimate = read_tum_maps(arguments.estimate);
  if (estimate.empty()) estimate.emplace_back();
  const std::vector<EvaluatedMap> maps = evaluate(reference, estimate, options);
  const EvaluatedMap& best = main_map(maps);
  if (!best.error)
    throw std::runtime_error("none of the " + std::to_string(maps.size()) + " maps: " + best.problem);
  print(maps, arguments);
  require_printed();
  tell_of_unmatched(best);
  if (!arguments.json.empty()) {
    write_file_atomically(arguments.json,
                          [&](std::ostream& out) { out << to_json(maps, arguments).dump(2) << '\n'; });
  }
  if (!arguments.plot.empty()) {
    std::vector<TrajectoryError> errors;
    for (const EvaluatedMap& map : maps) {
      if (map.error) errors.push_back(*map.error);
    }
    write_trajectory_plot(arguments.plot, united(errors));
  }
  if (!arguments.html.empty()) {
    std::vector<EvaluatedPath> paths;
    for (std::size_t i = 0; i < maps.size(); ++i) {
      if (maps[i].error) paths.push_back({estimate[i], *maps[i].error});
    }
    write_scene_page(arguments.html, evaluation_page(reference, paths));
  }
}

}  // namespace

// Options are declared before anything is caught: that fails for lack of memory only.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app(
      "Compares an estimated trajectory with a reference, both TUM files, after an alignment. If the "
      "estimate has several maps (separated by the comment `# a new map begins`), each map is aligned and "
      "evaluated separately.");
  app.add_option("--reference", arguments.reference, "reference poses (TUM file)")->required();
  app.add_option("--estimate", arguments.estimate, "estimated poses to evaluate (TUM file)")->required();
  app.add_option("--max-difference", arguments.max_difference,
                 "largest difference between the stamps of matched poses, s")
      ->capture_default_str()
      ->check(number_between(0, 1e6));
  app.add_option("--align", arguments.align,
                 "sim3: with a scale; se3: the estimate is in the reference's units")
      ->capture_default_str()
      ->check(CLI::IsMember({"sim3", "se3"}));
  app.add_option("--delta", arguments.delta,
                 "step of the relative pose error: frames (10) or metres of path (1.5m)")
      ->capture_default_str();
  app.add_option("--json", arguments.json, "write the figures to this file");
  app.add_option("--plot", arguments.plot, "draw both trajectories and the error over time (png, jpg)");
  app.add_option("--html", arguments.html,
                 "write an offline HTML page with both trajectories in 3-D, coloured by error");
  return run_command_line("evaluate_trajectory", app, argc, argv, [&] {
    run(arguments);
    return 0;
  });
}
