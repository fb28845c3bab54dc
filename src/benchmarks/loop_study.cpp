// How loops come out on simulated walks, over many seeds.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <functional>
#include <map>
#include <string>

#include "simulation/walk_studies.h"
#include "tools/command_line.h"

namespace {

using namespace mono_pose_tracker;

struct Arguments {
  std::string walk = "block";
  int seeds = 30, first_seed = 0;
  double noise_px = 0.5;
  bool without = false, limit = false;
};

FeatureWalk make_walk(const std::string& name, std::uint64_t seed) {
  if (name == "eight") return figure_eight_walk(seed);
  if (name == "corridor") return corridor_walk(seed);
  if (name == "ring") return ring_walk(seed);
  return block_walk(seed);
}

void study(const Arguments& a) {
  int with_loop = 0, false_loops = 0;
  for (int seed = a.first_seed; seed < a.first_seed + a.seeds; ++seed) {
    const FeatureWalk walk = make_walk(a.walk, seed);
    TrackerOptions options;
    options.seed = seed;
    const LoopStudy s = run_loop_study(walk, walk_camera(), options, a.noise_px, seed, !a.without, a.limit);
    std::printf(
        "seed %2d: %d of %d registered, %d keyframes, %.0f m, position %.3f %%; search %.1f ms a keyframe "
        "(%.1f at most), mapping %.1f ms",
        seed, s.frames_posed, s.frames, s.keyframes, walk.length, 100 * s.position_rmse,
        1e3 * s.search_seconds / s.frames, 1e3 * s.slowest_search_s, 1e3 * s.map_seconds / s.frames);
    if (a.limit) std::printf("; limit %.3f %%", 100 * s.limit_rmse);
    bool right = false;
    for (const StudiedLoop& loop : s.loops) {
      // Cameras farther apart look at other houses; and a door taken for the next one is 3 m of drift, more
      // than there was.
      constexpr double kSamePlace = 10;  // m
      if (loop.apart < kSamePlace && loop.drift_after < std::max(0.01, loop.drift_before)) {
        right = true;
      } else {
        ++false_loops;
      }
      std::printf("; loop %d-%d, %.1f m apart, drift %.2f %% -> %.2f %%", loop.from_frame, loop.to_frame,
                  loop.apart, 100 * loop.drift_before, 100 * loop.drift_after);
    }
    with_loop += right;
    std::printf("\n");
    std::fflush(stdout);
  }
  std::printf("%s: a true loop with %d of %d seeds, %d false loops\n", a.walk.c_str(), with_loop, a.seeds,
              false_loops);
}

}  // namespace

// Options are declared before anything is caught: that fails for lack of memory only.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
  Arguments a;
  CLI::App app(
      "Closes loops on simulated walks (features with descriptors of their own, no images), over many "
      "seeds.");
  app.add_option("--walk", a.walk, "block, eight, corridor or ring [block]")
      ->check(CLI::IsMember({"block", "eight", "corridor", "ring"}));
  app.add_option("--seeds", a.seeds, "how many [30]")->check(CLI::PositiveNumber);
  app.add_option("--first-seed", a.first_seed, "[0]")->check(CLI::NonNegativeNumber);
  app.add_option("--noise", a.noise_px, "of a feature, px [0.5]")->check(CLI::NonNegativeNumber);
  app.add_flag("--without", a.without, "closes no loop, to measure the drift");
  app.add_flag("--limit", a.limit,
               "error of a bundle adjustment of the keyframes' observations that starts from the truth");
  return run_command_line("loop_study", app, argc, argv, [&] {
    study(a);
    require_printed();
    return 0;
  });
}
