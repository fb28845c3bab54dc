// Times our SIFT beside cv::SIFT on images: one thread, the same budget.

#include <benchmark/benchmark.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "common/toolchain.h"
#include "io/image_source.h"
#include "mono_pose_tracker/features/sift.h"
#include "tools/command_line.h"

namespace mono_pose_tracker {
namespace {

struct Arguments {
  std::string images;
  int max_images = 10, max_features = 1000;
  double seconds = 1;
};

std::vector<cv::Mat> read_gray(const Arguments& a) {
  std::vector<cv::Mat> images;
  const auto source = open_images(a.images);
  while (static_cast<int>(images.size()) < a.max_images) {
    const SourceImage image = source->next();
    if (image.kind == SourceImage::Kind::kEnd) break;
    if (image.kind == SourceImage::Kind::kSkipped) continue;
    cv::Mat gray = image.image;
    if (gray.channels() == 3) cv::cvtColor(image.image, gray, cv::COLOR_BGR2GRAY);
    images.push_back(gray);
  }
  if (images.empty()) throw std::runtime_error(a.images + ": no image could be read");
  return images;
}

/// cv::SIFT with Lowe's settings; ours with the same from octave -1, else with its own defaults.
SiftOptions options_of(const Arguments& a, const std::string& implementation, int first_octave) {
  SiftOptions options;
  options.implementation = implementation;
  options.first_octave = first_octave;
  options.max_features = a.max_features;
  if (first_octave == -1) {
    options.sigma = 1.6f;
    options.contrast_threshold = 0.04f;
    options.min_features = 0;
  }
  return options;
}

void time_extractor(benchmark::State& state, const std::vector<cv::Mat>& images, const SiftOptions& options) {
  const auto extractor = make_sift_extractor(options);
  FeatureSet set;
  double features = 0;
  for (const cv::Mat& image : images) {  // buffers grow now, not while it counts
    extractor->extract(image, cv::Mat(), &set);
    features += set.size();
  }
  std::size_t next = 0;
  for ([[maybe_unused]] auto _ : state) {
    extractor->extract(images[next++ % images.size()], cv::Mat(), &set);
    benchmark::DoNotOptimize(set.features.data());
  }
  state.counters["features"] = features / static_cast<double>(images.size());
}

/// Prints as usual and keeps the CPU times.
class KeepingReporter : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    benchmark::ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs) cpu_ms_[run.benchmark_name()] = run.GetAdjustedCPUTime();
  }
  double ms(const std::string& name) const {
    const auto found = std::find_if(cpu_ms_.begin(), cpu_ms_.end(), [&](const auto& entry) {
      return entry.first.compare(0, name.size(), name) == 0;
    });
    return found == cpu_ms_.end() ? 0 : found->second;
  }

 private:
  std::map<std::string, double> cpu_ms_;
};

void run(const Arguments& a) {
  cv::setNumThreads(1);
  const std::vector<cv::Mat> images = read_gray(a);
  std::printf("%zu images, the first %dx%d; at most %d features\n", images.size(), images[0].cols,
              images[0].rows, a.max_features);
  const auto add = [&](const std::string& name, const SiftOptions& options) {
    benchmark::RegisterBenchmark(
        name.c_str(), [&images, options](benchmark::State& state) { time_extractor(state, images, options); })
        ->Unit(benchmark::kMillisecond)
        ->MinTime(a.seconds);
  };
#ifdef MONO_POSE_TRACKER_WITH_OPENCV_SIFT
  add("cv_sift", options_of(a, "opencv", -1));
#endif
  for (const int octave : {-1, 0, 1}) {
    add("own/first_octave:" + std::to_string(octave), options_of(a, "own", octave));
  }
  KeepingReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
#ifdef MONO_POSE_TRACKER_WITH_OPENCV_SIFT
  for (const int octave : {-1, 0, 1}) {
    std::printf("CPU time, ours from octave %2d : cv::SIFT (always from -1)  %.3f\n", octave,
                reporter.ms("own/first_octave:" + std::to_string(octave)) / reporter.ms("cv_sift"));
  }
#endif
}

}  // namespace
}  // namespace mono_pose_tracker

// Options are declared before anything is caught: that fails for lack of memory only.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
  using namespace mono_pose_tracker;
  CLI::App app("Compares the times of own SIFT and cv::SIFT: CPU time of one thread, by google-benchmark.",
               "feature_benchmark");
  Arguments arguments;
  app.add_option("--images", arguments.images, "folder of images, or a list")->required();
  app.add_option("--max-images", arguments.max_images, "only the first so many [10]")
      ->check(CLI::Range(1, 100000));
  app.add_option("--max-features", arguments.max_features, "budget of both [1000]")
      ->check(CLI::Range(0, 1000000));
  app.add_option("--seconds", arguments.seconds, "of CPU time for each [1]")->check(CLI::Range(0.01, 1000.0));
  return run_command_line("feature_benchmark", app, argc, argv, [&] {
    run(arguments);
    require_printed();
    return 0;
  });
}
