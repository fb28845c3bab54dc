#include <benchmark/benchmark.h>

#include <CLI/CLI.hpp>
#include <functional>
#include <map>
#include <memory>
#include <utility>

#include "common/statistics.h"
#include "evaluation/relative_pose_choice.h"
#include "geometry/essential.h"
#include "simulation/solver_problems.h"
#include "tools/command_line.h"
#include "tools/study/minimal_solvers.h"
#include "tools/study/robust_estimators.h"

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
      two_view_problems<N>("nearly_only_turned", count,
                           [](Random& random) { return near_rotation_problem<N>(random, 0.01); }),
  };
}

template <class Make>
ProblemSet<PoseProblem, Rigid3> pose_problems(const std::string& name, int count, Make make) {
  ProblemSet<PoseProblem, Rigid3> set;
  set.name = name;
  Random random(1);
  for (int i = 0; i < count; ++i) {
    set.problems.push_back(make(random));
    set.truths.push_back(set.problems.back().camera_from_map);
  }
  return set;
}

std::vector<ProblemSet<PoseProblem, Rigid3>> pose_problem_sets(int count) {
  const auto flat = [](double height) {
    return [height](Random& random) { return flat_triangle_problem(random, height); };
  };
  return {pose_problems("random_pose", count, random_pose_problem),
          pose_problems("danger_cylinder", count, danger_cylinder_problem),
          pose_problems("flat_triangle_1e-2", count, flat(1e-2)),
          pose_problems("flat_triangle_1e-3", count, flat(1e-3)),
          pose_problems("flat_triangle_1e-4", count, flat(1e-4))};
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
    for ([[maybe_unused]] auto _ : state) {
      benchmark::DoNotOptimize(prepared.run(i));
      i = i + 1 < timed ? i + 1 : 0;
    }
    // The benchmark is entered several times to find its number of iterations; the solutions stay the same.
    static std::map<std::string, Soundness> known;
    auto found = known.find(name);
    if (found == known.end()) found = known.emplace(name, soundness(prepared, set->truths)).first;
    const Soundness& s = found->second;
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

/// Problems of a kind, made when the first estimator asks for them; of all kinds together there may be
/// gigabytes.
class RobustProblems {
 public:
  RobustProblems(int count, std::uint64_t seed, std::function<Matches(Random&)> make)
      : count_(count), seed_(seed), make_(std::move(make)) {}

  int count() const { return count_; }

  const std::vector<Matches>& get() const {
    static const RobustProblems* owner = nullptr;
    static std::vector<Matches> problems;
    if (owner == this) return problems;
    owner = this;
    problems.clear();
    Random random(seed_);
    for (int i = 0; i < count_; ++i) problems.push_back(make_(random));
    return problems;
  }

 private:
  int count_;
  std::uint64_t seed_;
  std::function<Matches(Random&)> make_;
};

/// Milliseconds of an estimator on as many problems as there are trials, each solved once, and its errors.
void register_estimator(const std::string& name, const RobustEstimator& estimator,
                        const std::shared_ptr<const RobustProblems>& source, bool has_scale) {
  const auto run = [=](benchmark::State& state) {
    const std::vector<Matches>* problems = &source->get();
    std::vector<Rigid3> poses(problems->size());
    std::size_t i = 0;
    for ([[maybe_unused]] auto _ : state) {
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
  benchmark::RegisterBenchmark(name.c_str(), run)->Iterations(source->count())->Unit(benchmark::kMillisecond);
}

/// Robust estimators on 500 matches of two views and on 300 of a view and a map, 1 px of noise.
void register_estimators(int trials) {
  const auto register_problems = [trials](const std::string& method, const std::string& scene, int percent,
                                          const std::vector<RobustEstimator>& estimators, bool has_scale,
                                          const std::function<Matches(Random&)>& make) {
    const std::string problem = method + "/" + scene + "/" + std::to_string(percent) + "%_outliers/";
    const auto problems = std::make_shared<RobustProblems>(trials, static_cast<std::uint64_t>(percent), make);
    for (const RobustEstimator& e : estimators) register_estimator(problem + e.name, e, problems, has_scale);
  };
  const std::vector<int> percents = {10, 30, 50, 70, 80, 90};
  const std::map<std::string, TwoViewScene> scenes = {{"general_box", TwoViewScene::kGeneral},
                                                      {"planar_box", TwoViewScene::kPlanar},
                                                      {"forward_motion", TwoViewScene::kForward}};
  for (const auto& [name, scene] : scenes) {
    for (const int percent : percents) {
      register_problems("relative_pose", name, percent, relative_pose_estimators(), false,
                        [scene = scene, percent](Random& random) {
                          return two_view_matches(scene, 500, percent / 100.0, random);
                        });
    }
  }
  const std::map<std::string, double> boxes = {{"general_box", 1.0}, {"planar_box", 0.01}};
  for (const auto& [name, depth_by_width] : boxes) {
    for (const int percent : percents) {
      register_problems("absolute_pose", name, percent, absolute_pose_estimators(), true,
                        [depth_by_width = depth_by_width, percent](Random& random) {
                          return pose_matches(depth_by_width, 300, percent / 100.0, random);
                        });
    }
  }
}

void register_benchmarks(int trials, int estimator_trials) {
  std::vector<EpipolarSolver<5>> five_point = five_point_solvers();
  five_point.push_back(five_point_motions());
  register_all("five_point", five_point, two_view_problem_sets<5>(trials));
  register_all("seven_point", seven_point_solvers(), two_view_problem_sets<7>(trials));
  register_all("p3p", p3p_solvers(), pose_problem_sets(trials));
  register_estimators(estimator_trials);
}

// The exit status.
int run_benchmarks(char* program, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "--benchmark_counters_tabular=true");
  std::vector<char*> pointers = {program};
  for (std::string& argument : arguments) pointers.push_back(&argument[0]);
  int count = static_cast<int>(pointers.size());
  benchmark::Initialize(&count, pointers.data());
  if (benchmark::ReportUnrecognizedArguments(count, pointers.data())) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace
}  // namespace mono_pose_tracker

// Options are declared before anything is caught: that fails for lack of memory only.
// NOLINTNEXTLINE(bugprone-exception-escape)
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
  return run_command_line("solver_benchmark", app, argc, argv, [&] {
    cv::setNumThreads(1);
    register_benchmarks(trials, estimator_trials);
    return run_benchmarks(argv[0], app.remaining());
  });
}
