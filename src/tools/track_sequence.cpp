// Tracks every frame of a recording and writes its poses and its map.

#include <glob.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <stdexcept>

#include "bag_input.h"
#include "camera/camera_parameters.h"
#include "command_line.h"
#include "common/text.h"
#include "features/stereo_pair.h"
#include "looked_at_source.h"
#include "mono_pose_tracker/common/status.h"
#include "mono_pose_tracker/io/camera_yaml.h"
#include "mono_pose_tracker/io/map_file.h"
#include "mono_pose_tracker/io/trajectory.h"
#include "mono_pose_tracker/tracking/options_table.h"
#include "pipeline/recording_pipeline.h"
#include "progress.h"
#include "results/alignment.h"
#include "results/model_export.h"
#include "results/outputs.h"
#include "results/recording_files.h"
#include "results/report.h"
#include "track_sequence_arguments.h"
#include "tracking/background_image.h"
#include "tracking/tracker_impl.h"
#include "viewer/scene_page.h"
#include "written_files.h"

namespace {

namespace fs = std::filesystem;
using namespace mono_pose_tracker;

// For images of 16 bits: chosen from the first images, equal for each pass.
GreyLevelChoice levels_of(const Arguments& a) {
  try {
    GreyLevelChoice levels(a.grey_levels);
    if (!a.images.empty()) look_at_first(a.images, &levels);
    if (!a.bags.empty()) look_at_first_of_bags(a.bags, a.image_topic, &levels);
    return levels;
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(std::string("--grey-levels ") + error.what());
  }
}

std::function<std::unique_ptr<ImageSource>()> source_of(const Arguments& a, const GreyLevels& levels) {
  if (!a.images.empty()) return [a, levels] { return open_images(a.images, levels); };
  if (!a.video.empty()) return [a] { return open_video(a.video); };
  if (!a.bags.empty()) return [a, levels] { return open_bags(a.bags, a.image_topic, levels); };
  throw std::runtime_error("no input: give --images, --video or --bag");
}

// The first image that can be read.
SourceImage first_image(const Arguments& a, const LookedAtSource& source) {
  SourceImage image = source.first();
  if (image.kind == SourceImage::Kind::kEnd) {
    const std::string bag = a.bags.empty() ? "" : a.bags.front();
    throw std::runtime_error(a.images + a.video + bag + ": no image in it could be read" +  // one of them
                             (image.problem.empty() ? "" : ": " + image.problem));
  }
  return image;
}

// Of the ratio of a pixel's sides: calibrations find it to a tenth of this.
constexpr double kSquarePixels = 0.02;

// An anamorphic video, with the calibration of images that were made square.
std::string doubt_of_aspect(const LookedAtSource& source, const CameraParameters& camera) {
  const double of_video = source.pixel_aspect(), of_camera = camera.fy / camera.fx;
  if (std::abs(of_video - 1) <= kSquarePixels || std::abs(of_video / of_camera - 1) <= kSquarePixels)
    return "";
  return formatted(
      "the video has a pixel aspect ratio (width / height) of %.3f, but the calibration has %.3f (fy / fx): "
      "the map is stretched if the calibration is not of this video. Calibrate with frames of the video as "
      "they are stored",
      of_video, of_camera);
}

Calibration calibration_of(const Arguments& a, const LookedAtSource& source) {
  Calibration calibration;
  if (a.hfov) {
    const cv::Size size = first_image(a, source).image.size();
    calibration.camera = guess_camera(size.width, size.height, *a.hfov);
    calibration.camera.fy *= source.pixel_aspect();  // hfov is of the width
    if (const double aspect = source.pixel_aspect(); std::abs(aspect - 1) > kSquarePixels)
      calibration.note = formatted(
          "the video has a pixel aspect ratio (width / height) of %.3f, which is used to guess fy", aspect);
    calibration.source = CalibrationSource::kGuessed;
    return calibration;
  }
  const std::string topic = a.bags.empty() ? "" : topic_of_bags(a.bags, a.image_topic);
  calibration.rectification = decide_rectification(a.rectified, topic);
  bool has_distortion = false;
  if (!a.camera.empty()) {
    const CalibrationFile file = read_calibration_yaml(a.camera, calibration.rectification->is_rectified);
    calibration.camera = file.camera;
    has_distortion = file.has_distortion;
    calibration.note = file.note;
    calibration.size_origin = "image_width and image_height of " + a.camera;
  } else if (!a.bags.empty()) {
    const ConvertedCamera of_bag =
        calibration_of_bags(a.bags, a.image_topic, a.camera_info_topic, a.rectified);
    calibration.camera = of_bag.parameters;
    has_distortion = of_bag.has_distortion;
    calibration.note = of_bag.note;
    calibration.size_origin = of_bag.size_origin;
  } else {
    throw std::runtime_error(
        "no calibration: give --camera (the YAML file that camera_calibration writes) or --hfov (a guess)");
  }
  calibration.contradiction = rectification_contradiction(a.rectified, topic, has_distortion);
  if (calibration.contradiction.empty())
    calibration.contradiction = doubt_of_aspect(source, calibration.camera);
  return calibration;
}

// The size of the first image that can be read must be the camera's, and it must be of one camera.
void check_first_image(const Arguments& a, const LookedAtSource& source, Calibration* calibration) {
  const CameraParameters& camera = calibration->camera;
  const SourceImage image = first_image(a, source);
  if (image.image.cols == camera.width && image.image.rows == camera.height) {
    if (calibration->contradiction.empty()) calibration->contradiction = stereo_pair_text(image.image);
    if (calibration->contradiction.empty() && !a.images.empty())
      calibration->contradiction = mixed_bits_text(a.images);
    return;
  }
  const std::string aspect = doubt_of_aspect(source, camera);
  throw std::runtime_error(image.name + ": " +
                           size_mismatch_text(image.image.cols, image.image.rows, camera.width, camera.height,
                                              calibration->size_origin) +
                           (aspect.empty() ? "" : "; " + aspect));
}

// Checked before the work, not image by image.
void check_background_image(const SegmentationOptions& options, const CameraParameters& camera) {
  const cv::Mat image = read_background_image(options);
  if (image.empty() || (image.cols == camera.width && image.rows == camera.height)) return;
  throw std::runtime_error("segmentation/background_image = " + options.background_image + ": is " +
                           std::to_string(image.cols) + "x" + std::to_string(image.rows) +
                           ", expected the images' " + std::to_string(camera.width) + "x" +
                           std::to_string(camera.height));
}

Outputs outputs_of(const Arguments& a) {
  const bool refines = a.map.empty() && (a.refine_camera || a.hfov);
  return {a.output,       a.save_map, a.write_masks,     a.undistorted,
          a.write_frames, refines,    a.save_view_graph, a.report == "full"};
}

// Checks before the work that all outputs can be written and that none is an input.
void check_outputs(const Arguments& a, const TrackerOptions& options) {
  Inputs inputs;
  for (const std::string& path :
       {a.images, a.video, a.camera, a.config, a.reference, a.align, options.segmentation.background_image}) {
    inputs.add(path);
  }
  for (const std::string& bag : a.bags) inputs.add(bag);
  // A map may be continued and saved to the same file.
  if (followed(a.map) != followed(a.save_map)) inputs.add(a.map);
  const std::vector<ImageFile> images = a.images.empty() ? std::vector<ImageFile>() : image_files(a.images);
  for (const ImageFile& image : images) inputs.add(image.path);
  if (!a.masks.empty()) add_masks(a.masks, images, &inputs);
  const Outputs outputs = outputs_of(a);
  refuse_among_images(a.images, outputs);
  refuse_to_overwrite(inputs, images, outputs);
  require_writable(outputs);
}

// Observations kept while a run goes on.
struct Observed {
  explicit Observed(bool keep_masks) : masks(keep_masks) {}

  MaskRecord masks;
  FrameNotes notes;
  PosesByMap live;
};

void tell_of_attempt(int attempt, bool quiet, RunProgress* progress) {
  if (quiet) return;
  progress->end_line();
  std::fprintf(stderr,
               "the map is not confirmed, or is of the wrong object: tracking again from another seed (%d)\n",
               attempt + 1);
}

// The result, and what was observed on the way to it.
struct Run {
  std::unique_ptr<Tracker> tracker;
  RecordingResult result;
  MaskRecord masks;
  FrameNotes notes;
  PosesByMap live;
};

Run track(const Arguments& a, const TrackerOptions& options, const Recording& recording,
          Calibration* calibration, RunProgress* progress) {
  std::optional<TrajectoryWriter> live;             // of the first attempt
  std::map<int, std::weak_ptr<Observed>> observed;  // by attempt; of the one that is kept in the end
  const auto observer_of = [&](int attempt) -> FrameObserver {
    const bool is_whole = attempt != RecordingPipeline::kBeginning;
    if (attempt > 0) tell_of_attempt(attempt, a.quiet, progress);
    if (attempt == 0) live.emplace((fs::path(a.output) / "trajectory_live.txt").string());
    const auto into = std::make_shared<Observed>(is_whole && (a.undistorted || !a.write_masks.empty()));
    observed[attempt] = into;
    return [&, attempt, is_whole, into](int pass, std::int64_t index, const FrameReport& report) {
      if (pass == 1) progress->show(report);
      if (pass == 1 && report.map_from_camera) {
        into->live[report.map_id].push_back({report.stamp_ns, *report.map_from_camera});
        if (attempt == 0) live->append(into->live[report.map_id].back(), report.map_id);
      }
      if (is_whole && (pass == 1 || report.map_from_camera)) {
        into->masks.add(index, report);
        into->notes.add(index, report);
      }
    };
  };
  const RecordingCamera camera{calibration->camera, calibration->source, a.refine_camera || a.hfov};
  TrackedRecording tracked = RecordingPipeline(recording, options, camera, observer_of).run();
  calibration->camera = tracked.calibration.camera;
  calibration->source = tracked.calibration.source;
  if (tracked.calibration.runs > 0) calibration->refined = tracked.calibration;
  const std::shared_ptr<Observed> kept = observed[tracked.attempt].lock();
  return {std::move(tracked.tracker), std::move(tracked.result), std::move(kept->masks),
          std::move(kept->notes), std::move(kept->live)};
}

std::vector<StampedPose> read_reference(const std::string& path) {
  std::vector<StampedPose> reference = read_tum(path);
  if (reference.empty()) throw std::runtime_error(path + ": holds no pose");
  return reference;
}

TrackerOptions options_of(const Arguments& a) {
  TrackerOptions options;
  if (!a.config.empty()) read_options_yaml(a.config, &options);
  if (a.seed) options.seed = *a.seed;
  if (a.localize_only) options.localize_only = true;
  cv::setNumThreads(1);
  return options.on_threads(a.threads);
}

// Given masks, and masks made by a chosen method, are written unchanged.
bool are_to_be_outlined(const Arguments& a, const Recording& recording, const RecordingResult& result,
                        const SegmentationOptions& segmentation) {
  const bool are_written = a.undistorted || !a.write_masks.empty();
  return are_written && result.tracked && !recording.masks && segmentation.may_find_motion();
}

void tell(const char* what, const std::vector<std::string>& lines) {
  for (const std::string& line : lines) std::fprintf(stderr, "%s%s\n", what, one_line(line).c_str());
}

void write_saved_map(const std::string& path, const AlignedResult& aligned, const Run& run) {
  SavedMaps saved = *run.tracker->copy_maps();
  move_as_aligned(run.result, aligned, &saved);
  write_map_file(path, saved);
}

// As it was aligned.
const Map& main_map(const Run& run) {
  return run.result.maps.empty() ? run.tracker->map() : run.result.maps.front().map;
}

void write_files(const Arguments& a, const Recording& recording, const Calibration& calibration,
                 const std::vector<StampedPose>& reference, const AlignedResult& aligned,
                 const Thumbnails& thumbnails, bool outlined, Run* run) {
  const fs::path output = a.output;
  const RecordingResult& result = run->result;
  write_tum_maps((output / "trajectory_live.txt").string(), std::move(run->live));
  if (!result.tracked) write_tum((output / "trajectory.txt").string(), {});
  if (result.tracked) write_results(output, calibration.camera, result, reference, aligned);
  if (result.tracked) write_pages(output, calibration.camera, run->notes, thumbnails, result);
  if (calibration.refined) {
    write_camera_yaml((output / "camera_refined.yaml").string(), "camera", calibration.camera);
  }
  if (result.tracked && !a.save_view_graph.empty())
    write_view_graph(a.save_view_graph, run->tracker->impl().view_graph(), main_map(*run));
  if (result.tracked && a.report == "full")
    draw_view_graph((output / "view_graph.png").string(), run->tracker->impl().view_graph(), main_map(*run));
  if (result.tracked && !a.save_map.empty()) write_saved_map(a.save_map, aligned, *run);
  if (outlined) outline_masks(recording, result, CameraModel(calibration.camera), &run->masks);
  if (!a.write_masks.empty()) write_masks(a.write_masks, recording, result, run->masks);
  if (a.write_frames) write_frames(output / "frames", recording, result);
  if (result.tracked && a.undistorted) {
    write_undistorted(output / "undistorted", CameraModel(calibration.camera), recording, result, run->masks);
  }
}

// Writes the report, also if other files fail. A later interruption only skips images that are not written
// yet. Includes the total time.
double write_all(const Arguments& a, const TrackerOptions& options, const Recording& recording,
                 const Calibration& calibration, const std::vector<StampedPose>& reference,
                 const AlignedResult& aligned, const Thumbnails& thumbnails,
                 std::chrono::steady_clock::time_point start, Run* run) {
  RecordingResult& result = run->result;
  const bool outlined = signals_caught == 0 && are_to_be_outlined(a, recording, result, options.segmentation);
  std::exception_ptr failure;
  try {
    write_files(a, recording, calibration, reference, aligned, thumbnails, outlined, run);
  } catch (const std::exception& e) {
    failure = std::current_exception();
    result.problems.push_back(e.what());
  }
  if (recording.interrupted() && (a.undistorted || a.write_frames || !a.write_masks.empty())) {
    result.warnings.push_back("interrupted while files were written: masks or images may be missing");
    tell("warning: ", {result.warnings.back()});
  }
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  write_report((fs::path(a.output) / "report.json").string(), result, main_map(*run), run->masks, calibration,
               aligned.report, options.seed, wall.count());
  if (failure) std::rethrow_exception(failure);
  return wall.count();
}

Recording recording_of(const Arguments& a, const LookedAtSource& source,
                       const std::shared_ptr<Thumbnails>& thumbnails) {
  Recording recording;
  recording.open = [source, thumbnails] { return with_thumbnails(source.open(), thumbnails); };
  recording.max_frames = a.max_frames;
  recording.threads = a.threads;
  recording.feature_memory.memory_bytes = a.feature_memory_mb << 20;
  recording.feature_memory.folder = a.output;
  recording.interrupted = [] { return signals_caught > 0; };
  return recording;
}

int images_to_track(const Arguments& a, const LookedAtSource& source) {
  const int size = source.open()->size();
  return size > 0 && a.max_frames >= 0 && a.max_frames < size ? static_cast<int>(a.max_frames) : size;
}

// Warnings that are known after tracking.
void tell_of_result(const TrackerOptions& options, RecordingResult* result) {
  if (options.scale.odometry) {
    result->warnings.push_back(
        "scale/odometry is ignored here: only the nodelet uses it, with odometry from tf");
  }
  const std::string spaces = doubt_of_names(result->names);
  if (result->tracked && !spaces.empty()) result->warnings.push_back(spaces);
  tell("", result->problems);
  tell("warning: ", result->warnings);
}

void print_input(const Arguments& a, const LookedAtSource& source, const Calibration& calibration) {
  if (a.quiet) return;
  if (calibration.rectification)
    std::fprintf(stderr, "the images are treated as %s: %s\n",
                 calibration.rectification->is_rectified ? "rectified" : "raw",
                 calibration.rectification->reason.c_str());
  if (!source.first().mask.empty())
    std::fprintf(stderr, "the images have an alpha channel: transparent pixels (alpha 0) are masked\n");
  if (!calibration.note.empty()) std::fprintf(stderr, "calibration: %s\n", calibration.note.c_str());
}

// Files of an earlier run are kept: hours of dense reconstruction may depend on them.
void tell_of_earlier_files(const Arguments& a, const RecordingResult& result) {
  for (const fs::path& path : earlier_files(outputs_of(a), a.camera, result.maps.size())) {
    std::fprintf(stderr, "%s: of an earlier run, does not belong to these results\n", path.c_str());
  }
}

void tell_of_files(const Arguments& a, const Run& run, double seconds) {
  const RecordingResult& result = run.result;
  const Map& map = run.tracker->map();
  std::printf("%zu of %ld images registered (%ld live), %zu keyframes, %zu points, %.1f s%s: %s\n",
              result.trajectory.size(), static_cast<long>(result.frames_total),
              static_cast<long>(result.frames_posed_live), map.keyframes().size(), map.landmarks().size(),
              seconds, rests_on_two_views(result) ? " (two views only: unconfirmed)" : "", a.output.c_str());
}

AlignmentOptions alignment_options(const TrackerOptions& options) {
  AlignmentOptions alignment;
  alignment.positions.seed = options.seed;
  return alignment;
}

// A pattern that the shell has left, as within quotes, is expanded; each bag is read once.
std::vector<std::string> expanded(const std::vector<std::string>& patterns) {
  std::vector<std::string> paths;
  for (const std::string& pattern : patterns) {
    std::vector<std::string> found = {pattern};
    std::error_code ignored;
    glob_t matches{};
    if (!fs::exists(pattern, ignored) && glob(pattern.c_str(), 0, nullptr, &matches) == 0) {
      found.assign(matches.gl_pathv, matches.gl_pathv + matches.gl_pathc);
    }
    globfree(&matches);
    for (const std::string& path : found) {
      if (std::find(paths.begin(), paths.end(), path) == paths.end()) paths.push_back(path);
    }
  }
  return paths;
}

int run(const Arguments& given) {
  Arguments a = given;
  a.bags = expanded(given.bags);
  check_bags(a.bags);
  const auto start = std::chrono::steady_clock::now();
  const TrackerOptions options = options_of(a);
  const std::vector<StampedPose> reference =
      a.reference.empty() ? std::vector<StampedPose>() : read_reference(a.reference);
  std::optional<GivenPositions> positions;
  if (!a.align.empty()) positions = read_given_positions(a.align);
  const GreyLevelChoice levels = levels_of(a);
  const LookedAtSource source(source_of(a, levels.levels()));
  const auto thumbnails = std::make_shared<Thumbnails>();
  Recording recording = recording_of(a, source, thumbnails);
  Calibration calibration = calibration_of(a, source);
  if (a.hfov && !a.bags.empty() && !a.quiet)
    std::fprintf(stderr, "--hfov is used instead of any camera_info in the bag\n");
  std::optional<SavedMaps> loaded;
  if (!a.map.empty()) loaded = read_map_file(a.map, descriptor_kind(options));
  if (loaded) recording.loaded = &*loaded;
  make_tracker(options, calibration.camera, recording.loaded);  // refuses options before the work
  std::optional<MaskFolder> masks;
  if (!a.masks.empty()) recording.masks = &masks.emplace(a.masks);
  check_first_image(a, source, &calibration);
  check_background_image(options.segmentation, calibration.camera);
  check_outputs(a, options);

  print_input(a, source, calibration);
  if (!a.quiet && !levels.text().empty()) std::fprintf(stderr, "%s\n", levels.text().c_str());
  const std::string unread = a.images.empty() ? std::string() : unread_images(a.images);
  end_on_signals();
  RunProgress progress(images_to_track(a, source), a.quiet);
  recording.begin_stage = [&](RecordingStage stage) { progress.begin(stage); };
  Run run = track(a, options, recording, &calibration, &progress);
  progress.end_line();
  if (!unread.empty()) run.result.warnings.push_back(a.images + ": some images are not read" + unread);
  if (!calibration.contradiction.empty()) run.result.warnings.push_back(calibration.contradiction);
  AlignedResult aligned;
  if (positions) aligned = align_to_positions(*positions, alignment_options(options), &run.result, &run.live);
  tell_of_result(options, &run.result);
  end_on_signals();  // one that came while images were tracked has had its effect
  recording.interrupted = [before = signals_caught.load()] { return signals_caught > before; };
  progress.begin(RecordingStage::kWriting);
  const double seconds =
      write_all(a, options, recording, calibration, reference, aligned, *thumbnails, start, &run);
  progress.end_line();
  if (!run.result.tracked) {
    std::fprintf(stderr, "%s: %s\n",
                 a.localize_only ? "no image could be registered" : "no map could be made",
                 run.result.reason.c_str());
    if (!a.quiet) tell_of_earlier_files(a, run.result);
    return end_status(1);
  }
  if (!a.quiet) {
    tell_of_files(a, run, seconds);
    tell_of_earlier_files(a, run.result);
    if (!a.write_masks.empty() && run.masks.frames() == 0)
      std::fprintf(stderr, "%s: no image had a mask, neither from --masks nor from segmentation\n",
                   a.write_masks.c_str());
  }
  return end_status(0);
}

}  // namespace

// Options are declared before anything is caught: that fails for lack of memory only.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
  CLI::App app("Tracks every image of a recording and writes poses, points, a COLMAP model and an overview.",
               "track_sequence");
  Arguments arguments;
  declare(app, arguments);
  return run_command_line("track_sequence", app, argc, argv, [&] { return run(arguments); });
}
