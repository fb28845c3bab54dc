#include <benchmark/benchmark.h>

#include <CLI/CLI.hpp>
#include <map>
#include <memory>

#include "mono_pose_tracker/evaluation/relative_pose_choice.h"
#include "mono_pose_tracker/geometry/essential.h"
#include "mono_pose_tracker/simulation/two_view_problem.h"
#include "study/minimal_solvers.h"
#include "study/robust_estimators.h"
#include "study/robust_problems.h"
#include "study/statistics.h"

namespace mono_pose_tracker {
namespace {

/// Problems of one kind and the true solution of each.
template <class Problem, class Solution>
struct ProblemSet {
  std::string name;
  std::vector<Problem> problems;
  std::vector<Solution> truths;
};

/// How sound a solver is on a set of problems without noise.
struct Soundness {
  double missed_at_1e2 = 0, missed_at_1e6 = 0, median = 0, p99 = 0, solutions = 0;
};

template <int N, class Make>
ProblemSet<BearingSample<N>, Eigen::Matrix3d> two_view_problems(const std::string& name, int count,
                                                                Make make) {
  ProblemSet<BearingSample<N>, Eigen::Matrix3d> set;
  set.name = name;
  Random random(1);
  for (int i = 0; i < count; ++i) {
    const TwoViewProblem<N> problem = make(random);
    set.problems.push_back({problem.bearings1, problem.bearings2});
    set.truths.push_back(essential_matrix(problem.second_from_first));
  }
  return set;
}

template <int N>
std::vector<ProblemSet<BearingSample<N>, Eigen::Matrix3d>> two_view_problem_sets(int count) {
  const auto box = [](double depth_by_width) {
    return [depth_by_width](Random& random) { return box_problem<N>(random, depth_by_width); };
  };
  const auto motion = [](const Eigen::Vector3d& direction) {
    return [direction](Random& random) { return motion_problem<N>(random, direction); };
  };
  return {
      two_view_problems<N>("planar_box", count, box(0.01)),
      two_view_problems<N>("semi_planar_box", count, box(0.1)),
      two_view_problems<N>("general_box", count, box(1.0)),
      two_view_problems<N>(
          "random_motion", count,
          [](Random& random) { return motion_problem<N>(random, random_direction(random)); }),
      two_view_problems<N>("sideways_motion", count, motion(Eigen::Vector3d::UnitX())),
      two_view_problems<N>("forward_motion", count, motion(Eigen::Vector3d::UnitZ())),
  };
}

/// Points at depths 1 to 10 in a 90 degree view, the map turned and shifted at random.
ProblemSet<PoseSample, Rigid3> pose_problems(int count) {
  ProblemSet<PoseSample, Rigid3> set;
  set.name = "random_pose";
  Random random(1);
  for (int i = 0; i < count; ++i) {
    const Rigid3 camera_from_map(random_rotation(random), 3 * random_direction(random));
    const Rigid3 map_from_camera = camera_from_map.inverse();
    PoseSample sample;
    for (int k = 0; k < 3; ++k) {
      const double depth = random.uniform(1, 10);
      const Eigen::Vector3d x(random.uniform(-depth, depth), random.uniform(-depth, depth), depth);
      sample.points[k] = map_from_camera * x;
      sample.bearings[k] = x.normalized();
    }
    set.problems.push_back(sample);
    set.truths.push_back(camera_from_map);
  }
  return set;
}

double distance(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) { return distance_up_to_sign(a, b); }

double distance(const Rigid3& a, const Rigid3& b) {
  return (a.rotation_matrix() - b.rotation_matrix()).norm() + (a.translation - b.translation).norm();
}

template <class Prepared, class Solution>
Soundness soundness(const Prepared& solver, const std::vector<Solution>& truths) {
  Soundness result;
  std::vector<double> errors;
  for (std::size_t i = 0; i < truths.size(); ++i) {
    double best = 10;  // larger than any error there is: nothing found
    const std::vector<Solution> solutions = solver.solutions(i);
    for (const Solution& solution : solutions) {
      const double error = distance(solution, truths[i]);
      if (error < best) best = error;  // false for what is not a number
    }
    errors.push_back(best);
    result.missed_at_1e2 += best > 1e-2;
    result.missed_at_1e6 += best > 1e-6;
    result.solutions += static_cast<double>(solutions.size());
  }
  std::sort(errors.begin(), errors.end());
  result.median = quantile_of_sorted(errors, 0.5);
  result.p99 = quantile_of_sorted(errors, 0.99);
  result.solutions /= static_cast<double>(truths.size());
  return result;
}

template <class Problem, class Solution>
void register_benchmark(const std::string& method, const MinimalSolver<Problem, Solution>& solver,
                        std::shared_ptr<const ProblemSet<Problem, Solution>> set) {
  const std::string name = method + "/" + set->name + "/" + solver.name;
  const auto run = [solver, set, name](benchmark::State& state) {
    const auto prepared = solver.prepare(set->problems);
    // Enough problems that no branch of theirs is learnt by heart, few enough for the cache.
    const std::size_t timed = std::min<std::size_t>(set->problems.size(), 1000);
    std::size_t i = 0;
    for (auto _ : state) {
      benchmark::DoNotOptimize(prepared.run(i));
      i = i + 1 < timed ? i + 1 : 0;
    }
    // The benchmark is entered several times to find its number of iterations; the solutions stay the same.
    static std::map<std::string, Soundness> known;
    if (known.find(name) == known.end()) known[name] = soundness(prepared, set->truths);
    const Soundness& s = known[name];
    state.counters["missed_1e-2"] = s.missed_at_1e2;
    state.counters["missed_1e-6"] = s.missed_at_1e6;
    state.counters["log10_error_p50"] = std::log10(s.median);
    state.counters["log10_error_p99"] = std::log10(s.p99);
    state.counters["solutions"] = s.solutions;
  };
  benchmark::RegisterBenchmark(name.c_str(), run);
}

template <class Problem, class Solution>
void register_all(const std::string& method, const std::vector<MinimalSolver<Problem, Solution>>& solvers,
                  const std::vector<ProblemSet<Problem, Solution>>& sets) {
  for (const auto& set : sets) {
    const auto shared = std::make_shared<const ProblemSet<Problem, Solution>>(set);
    for (const auto& solver : solvers) register_benchmark(method, solver, shared);
  }
}

/// Milliseconds of an estimator on as many problems as there are trials, each solved once, and its errors.
void register_estimator(const std::string& name, const RobustEstimator& estimator,
                        std::shared_ptr<const std::vector<Matches>> problems, bool has_scale) {
  const auto run = [=](benchmark::State& state) {
    std::vector<Rigid3> poses(problems->size());
    std::size_t i = 0;
    for (auto _ : state) {
      // A failure leaves the pose that is furthest from any truth here: looking the other way.
      if (!estimator.estimate((*problems)[i], &poses[i])) {
        poses[i] = Rigid3((*problems)[i].truth.rotation * Eigen::Quaterniond(0, 0, 1, 0),
                          -(*problems)[i].truth.translation);
      }
      ++i;
    }
    std::vector<double> rotation, translation;
    double gross = 0;
    for (std::size_t k = 0; k < problems->size(); ++k) {
      const PoseError error = pose_error(poses[k], (*problems)[k].truth);
      rotation.push_back(error.rotation_deg);
      translation.push_back(error.translation_deg);
      gross += error.rotation_deg > 5;
    }
    std::sort(rotation.begin(), rotation.end());
    std::sort(translation.begin(), translation.end());
    state.counters["R_deg_p50"] = quantile_of_sorted(rotation, 0.5);
    state.counters["R_deg_p95"] = quantile_of_sorted(rotation, 0.95);
    if (!has_scale) {
      state.counters["T_deg_p50"] = quantile_of_sorted(translation, 0.5);
      state.counters["T_deg_p95"] = quantile_of_sorted(translation, 0.95);
    }
    state.counters["R_over_5_deg"] = gross;
  };
  benchmark::RegisterBenchmark(name.c_str(), run)
      ->Iterations(static_cast<benchmark::IterationCount>(problems->size()))
      ->Unit(benchmark::kMillisecond);
}

/// Robust estimators on 500 matches of two views and on 300 of a view and a map, 1 px of noise.
void register_estimators(int trials) {
  const std::map<std::string, double> scenes = {{"general_box", 1.0}, {"planar_box", 0.01}};
  for (const auto& [scene, depth_by_width] : scenes) {
    for (const int percent : {10, 30, 50, 70}) {
      const std::string problem = scene + "/" + std::to_string(percent) + "%_outliers/";
      Random random(static_cast<std::uint64_t>(percent));
      std::vector<Matches> two_views, poses;
      for (int i = 0; i < trials; ++i) {
        two_views.push_back(two_view_matches(random, 500, percent / 100.0, depth_by_width));
        poses.push_back(pose_matches(random, 300, percent / 100.0, depth_by_width));
      }
      const auto shared_two_views = std::make_shared<const std::vector<Matches>>(std::move(two_views));
      const auto shared_poses = std::make_shared<const std::vector<Matches>>(std::move(poses));
      for (const RobustEstimator& e : relative_pose_estimators()) {
        register_estimator("relative_pose/" + problem + e.name, e, shared_two_views, false);
      }
      for (const RobustEstimator& e : absolute_pose_estimators()) {
        register_estimator("absolute_pose/" + problem + e.name, e, shared_poses, true);
      }
    }
  }
}

}  // namespace
}  // namespace mono_pose_tracker

int main(int argc, char** argv) {
  using namespace mono_pose_tracker;
  CLI::App app(
      "Minimal solvers and robust estimators side by side: nanoseconds a call and, of so many problems "
      "without noise, those whose "
      "best "
      "solution misses the truth. Options of google-benchmark pass through, such as --benchmark_filter=REGEX "
      "and "
      "--benchmark_out=FILE.json");
  app.allow_extras();
  int trials = 10000;
  app.add_option("--trials", trials, "problems of each kind")
      ->check(CLI::Range(1, 10000000))
      ->capture_default_str();
  int estimator_trials = 50;
  app.add_option("--estimator-trials", estimator_trials, "problems of each kind for the robust estimators")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "solver_benchmark: %s\n", error.what());
    return 2;
  }

  cv::setNumThreads(1);
  register_all("five_point", five_point_solvers(), two_view_problem_sets<5>(trials));
  register_all("seven_point", seven_point_solvers(), two_view_problem_sets<7>(trials));
  register_all("p3p", p3p_solvers(), std::vector<ProblemSet<PoseSample, Rigid3>>{pose_problems(trials)});

  register_estimators(estimator_trials);

  std::vector<std::string> arguments = app.remaining();
  arguments.insert(arguments.begin(), argv[0]);
  arguments.insert(arguments.begin() + 1, "--benchmark_counters_tabular=true");
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(&argument[0]);
  int count = static_cast<int>(pointers.size());
  benchmark::Initialize(&count, pointers.data());
  if (benchmark::ReportUnrecognizedArguments(count, pointers.data())) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
