#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>

#include "command_line.h"
#include "common/rotation.h"
#include "common/statistics.h"
#include "common/threads.h"
#include "evaluation/relative_pose_choice.h"
#include "geometry/essential.h"
#include "io/files.h"
#include "progress.h"
#include "simulation/solver_problems.h"
#include "study/minimal_solvers.h"
#include "study/robust_estimators.h"

namespace mono_pose_tracker {
namespace {

constexpr int kLargestSample = 7;
constexpr double kDepthsByWidth[] = {0.01, 0.1, 1.0};
constexpr double kNoiseStepPx = 0.25;
constexpr int kNoiseSteps = 9;

struct Settings {
  std::filesystem::path output;
  int trials = 10000;
  double alpha_deg = 10;
  int check_points = 10;
  Choice choice = Choice::kCheirality;
  bool peers = false;
  int threads = 0;
  std::uint64_t seed = 1;
};

/// A solver by name that takes the first points of a problem and gives essential matrices.
struct Row {
  std::string name;
  int sample_size;
  std::function<std::vector<Eigen::Matrix3d>(const ChoiceInput&)> solve;
};

template <int N>
Row row_of(const std::string& name, const EpipolarSolver<N>& solver) {
  const auto solve = [solver](const ChoiceInput& input) {
    std::vector<BearingSample<N>> sample(1);
    std::copy(input.bearings1.begin(), input.bearings1.begin() + N, sample[0].bearings1.begin());
    std::copy(input.bearings2.begin(), input.bearings2.begin() + N, sample[0].bearings2.begin());
    std::vector<Eigen::Matrix3d> essentials = solver.prepare(sample).solutions(0);
    if (N == 7) {
      for (Eigen::Matrix3d& e : essentials) e = nearest_essential(e);
    }
    return essentials;
  };
  return {name, N, solve};
}

std::vector<Row> rows_of(bool peers) {
  std::vector<Row> rows;
  const auto add = [&](const auto& solvers, const std::string& kind) {
    for (const auto& solver : solvers) {
      if (peers || solver.name == "ours") {
        rows.push_back(row_of(solver.name == "ours" ? kind : kind + " " + solver.name, solver));
      }
    }
  };
  add(five_point_solvers(), "5-point");
  add(seven_point_solvers(), "7-point");
  return rows;
}

/// The same points for every solver: each takes its sample from the front, and all check with the last ones.
ChoiceInput make_input(const Settings& settings, double depth_by_width, double noise_px, std::uint64_t seed) {
  Random random(seed);
  ChoiceInput input;
  input.sample_size = kLargestSample;
  const int count = kLargestSample + settings.check_points;
  for (int i = 0; i < count; ++i) {
    const auto problem = box_problem<1>(random, depth_by_width, settings.alpha_deg * kDegree);
    input.true_second_from_first = problem.second_from_first;
    input.bearings1.push_back(disturbed(problem.bearings1[0], noise_px, random));
    input.bearings2.push_back(disturbed(problem.bearings2[0], noise_px, random));
  }
  return input;
}

/// The points used by a solver with this sample size; those of larger samples are excluded.
ChoiceInput with_sample_of(const ChoiceInput& all, int sample_size) {
  ChoiceInput input = all;
  input.sample_size = sample_size;
  for (auto* bearings : {&input.bearings1, &input.bearings2}) {
    bearings->erase(bearings->begin() + sample_size, bearings->begin() + kLargestSample);
  }
  return input;
}

struct Trial {
  PoseError pose;
  bool chosen = false;
  double nearest =
      2;  // distance of the best essential matrix from the truth, both of norm 1; 2 when there is none
};

Trial run_trial(const Row& row, const ChoiceInput& all, Choice choice) {
  Trial trial;
  const ChoiceInput input = with_sample_of(all, row.sample_size);
  const std::vector<Eigen::Matrix3d> essentials = row.solve(input);
  const Eigen::Matrix3d truth = essential_matrix(input.true_second_from_first);
  for (const Eigen::Matrix3d& e : essentials)
    trial.nearest = std::min(trial.nearest, distance_up_to_sign(e, truth));
  Rigid3 pose;
  trial.chosen = choose_pose(essentials, input, choice, &pose);
  if (trial.chosen) trial.pose = pose_error(pose, input.true_second_from_first);
  return trial;
}

/// trials[row][scene][noise][trial]
using Trials = std::vector<std::vector<std::vector<std::vector<Trial>>>>;

Trials run_all(const Settings& settings, const std::vector<Row>& rows) {
  Trials trials(rows.size(),
                {std::size(kDepthsByWidth),
                 std::vector<std::vector<Trial>>(kNoiseSteps, std::vector<Trial>(settings.trials))});
  const int jobs = static_cast<int>(std::size(kDepthsByWidth)) * kNoiseSteps * settings.trials;
  ProgressBar progress(jobs);
  parallel_for(jobs, settings.threads, [&](int job) {
    const int trial = job % settings.trials, noise = job / settings.trials % kNoiseSteps;
    const int scene = job / settings.trials / kNoiseSteps;
    const std::uint64_t seed = settings.seed * 1000000007ull + static_cast<std::uint64_t>(job);
    const ChoiceInput input = make_input(settings, kDepthsByWidth[scene], noise * kNoiseStepPx, seed);
    for (std::size_t row = 0; row < rows.size(); ++row) {
      trials[row][scene][noise][trial] = run_trial(rows[row], input, settings.choice);
    }
    progress.advance();
  });
  return trials;
}

/// Sorted values of one quantity of all trials.
template <class Value>
std::vector<double> sorted(const std::vector<Trial>& trials, Value value) {
  std::vector<double> values;
  for (const Trial& trial : trials) values.push_back(value(trial));
  std::sort(values.begin(), values.end());
  return values;
}

void write_errors(std::ostream& file, const std::vector<Row>& rows, const Trials& trials) {
  file
      << "solver,sample_size,depth_by_width,noise_px,trials,without_pose,rotation_q1_deg,rotation_median_deg,"
         "rotation_q3_deg,translation_q1_deg,translation_median_deg,translation_q3_deg\n";
  for (std::size_t row = 0; row < rows.size(); ++row) {
    for (std::size_t scene = 0; scene < std::size(kDepthsByWidth); ++scene) {
      for (int noise = 0; noise < kNoiseSteps; ++noise) {
        const std::vector<Trial>& all = trials[row][scene][noise];
        const auto without = std::count_if(all.begin(), all.end(), [](const Trial& t) { return !t.chosen; });
        const auto rotation = sorted(all, [](const Trial& t) { return t.pose.rotation_deg; });
        const auto translation = sorted(all, [](const Trial& t) { return t.pose.translation_deg; });
        file << rows[row].name << ',' << rows[row].sample_size << ',' << kDepthsByWidth[scene] << ','
             << noise * kNoiseStepPx << ',' << all.size() << ',' << without;
        for (const auto* values : {&rotation, &translation}) {
          for (const double share : {0.25, 0.5, 0.75}) file << ',' << quantile_of_sorted(*values, share);
        }
        file << '\n';
      }
    }
  }
}

/// How often the nearest solution without noise errs by 10^x: bins of half a decade, the first and last open.
void write_histogram(std::ostream& file, const std::vector<Row>& rows, const Trials& trials) {
  file << "solver,depth_by_width,log10_error,share\n";
  constexpr int kFirst = -34, kLast = 1;  // half decades: 10^-17 to 10^0.5
  for (std::size_t row = 0; row < rows.size(); ++row) {
    for (std::size_t scene = 0; scene < std::size(kDepthsByWidth); ++scene) {
      const std::vector<Trial>& all = trials[row][scene][0];
      std::map<int, int> counts;
      for (const Trial& trial : all) {
        const double half_decades = std::floor(2 * std::log10(std::max(trial.nearest, 1e-17)));
        ++counts[std::clamp(static_cast<int>(half_decades), kFirst, kLast)];
      }
      for (int bin = kFirst; bin <= kLast; ++bin) {
        file << rows[row].name << ',' << kDepthsByWidth[scene] << ',' << 0.5 * bin << ','
             << static_cast<double>(counts[bin]) / static_cast<double>(all.size()) << '\n';
      }
    }
  }
}

void write_file(const std::filesystem::path& path, const std::function<void(std::ostream&)>& write) {
  write_file_atomically(path.string(), [&](std::ostream& file) {
    file.precision(9);
    write(file);
  });
}

void run(const Settings& settings) {
  make_folder(settings.output);
  cv::setNumThreads(1);  // the trials are what runs in parallel
  const std::vector<Row> rows = rows_of(settings.peers);
  const Trials trials = run_all(settings, rows);
  write_file(settings.output / "errors.csv", [&](std::ostream& file) { write_errors(file, rows, trials); });
  write_file(settings.output / "histogram.csv",
             [&](std::ostream& file) { write_histogram(file, rows, trials); });
  std::printf("wrote %s and histogram.csv to the same folder\n", (settings.output / "errors.csv").c_str());
}

}  // namespace
}  // namespace mono_pose_tracker

// Options are declared before anything is caught: that fails for lack of memory only.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
  using namespace mono_pose_tracker;
  Settings settings;
  CLI::App app(
      "Compares the 5-point and the 7-point method on synthetic data: points in a box at distance 4, whose "
      "front subtends 45 degrees. The box rotates about the y axis through its centre. Reports the pose "
      "error of minimal samples over pixel noise. Writes errors.csv and histogram.csv; "
      "scripts/plot_experiment draws them");
  std::map<std::string, Choice> choices = {
      {"cheirality", Choice::kCheirality}, {"sampson", Choice::kSampson}, {"truth", Choice::kTruth}};
  app.add_option("--output", settings.output, "output folder, created if missing")->required();
  app.add_option("--trials", settings.trials, "trials per scene and noise level")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  app.add_option("--alpha", settings.alpha_deg, "rotation of the box, degrees")
      ->check(CLI::Range(-180.0, 180.0))
      ->capture_default_str();
  app.add_option("--check-points", settings.check_points,
                 "check points in addition to the sample, to choose among the solutions")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  app.add_option("--choice", settings.choice,
                 "choice among the solutions: cheirality (most sample points in front of both cameras, then "
                 "lowest Sampson error over sample and check points), sampson (lowest Sampson error, then "
                 "the pose with most points in front), truth (the solution nearest to the true pose)")
      ->transform(CLI::CheckedTransformer(choices, CLI::ignore_case))
      ->default_str("cheirality");
  app.add_flag("--peers", settings.peers, "also evaluate the solvers of OpenCV and OpenGV");
  settings.threads = processors();
  app.add_option("--threads", settings.threads, "number of threads; the results do not depend on it")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  app.add_option("--seed", settings.seed, "seed of the random numbers")
      ->capture_default_str()
      ->check(whole_number(0));
  return run_command_line("relative_pose_experiment", app, argc, argv, [&] {
    run(settings);
    return 0;
  });
}
