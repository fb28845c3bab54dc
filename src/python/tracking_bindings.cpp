#include <pybind11/stl.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>

#include "bindings.h"
#include "common/threads.h"
#include "io/image_coding.h"
#include "io/image_source.h"
#include "mono_pose_tracker/tracking/tracker.h"
#include "pipeline/recording_pipeline.h"

namespace mono_pose_tracker {
namespace {

/// An image of a list: a file, or pixels.
struct ListedImage {
  std::string path, name;
  cv::Mat pixels;
  std::string mask_path;
  cv::Mat mask;
};

std::string numbered_name(std::size_t index) {
  const std::string digits = std::to_string(index);
  return std::string(digits.size() < 6 ? 6 - digits.size() : 0, '0') + digits + ".png";
}

/// Images that the caller has or names one by one; the stamp is the index in seconds.
class ListedSource : public ImageSource {
 public:
  explicit ListedSource(std::shared_ptr<const std::vector<ListedImage>> images)
      : images_(std::move(images)) {}

  SourceImage next() override {
    SourceImage result;
    if (at_ == images_->size()) return result;
    const ListedImage& listed = (*images_)[at_];
    result.stamp_ns = static_cast<std::int64_t>(at_) * 1'000'000'000;
    result.name = result.mask_name = listed.name;
    ++at_;
    if (listed.path.empty()) {
      result.image = listed.pixels;
    } else {
      const DecodedImage decoded = read_image(listed.path);
      result.image = decoded.image;
      result.mask = decoded.mask;
      result.problem = decoded.problem;
    }
    result.kind = result.problem.empty() ? SourceImage::Kind::kImage : SourceImage::Kind::kSkipped;
    if (!listed.mask.empty()) result.mask = listed.mask;
    if (!listed.mask_path.empty() && result.problem.empty()) {
      std::string problem;
      result.mask = read_mask(listed.mask_path, result.image.size(), &problem);
      if (!problem.empty()) throw std::runtime_error(problem);
    }
    return result;
  }

  bool skip() override { return at_ < images_->size() && ++at_ > 0; }
  int size() const override { return static_cast<int>(images_->size()); }

 private:
  const std::shared_ptr<const std::vector<ListedImage>> images_;
  std::size_t at_ = 0;
};

void add_masks(const py::object& masks, const cv::Size& size_of_files, std::vector<ListedImage>* listed) {
  const py::list items(masks);
  if (items.size() != listed->size()) {
    throw std::invalid_argument("masks has " + std::to_string(items.size()) + " items: expected " +
                                std::to_string(listed->size()) + ", one for each image, or a folder");
  }
  for (std::size_t i = 0; i < items.size(); ++i) {
    ListedImage& image = (*listed)[i];
    if (is_path(items[i])) {
      image.mask_path = path_of(items[i]);
      continue;
    }
    const std::string name = "masks[" + std::to_string(i) + "]";
    const cv::Size size = image.pixels.empty() ? size_of_files : image.pixels.size();
    image.mask = mask_of(items[i], name.c_str(), size);
  }
}

/// size_of_files: of the images that are named by their paths.
std::vector<ListedImage> listed_images(const py::object& images, const py::object& masks,
                                       const cv::Size& size_of_files) {
  std::vector<ListedImage> listed;
  for (const py::handle& item : images) {
    ListedImage image;
    if (is_path(item)) {
      image.path = path_of(item);
      image.name = image.path;
    } else {
      const std::string name = "images[" + std::to_string(listed.size()) + "]";
      image.pixels = image_of(item, name.c_str());
      image.name = numbered_name(listed.size());
    }
    listed.push_back(std::move(image));
  }
  if (!masks.is_none() && !is_path(masks)) add_masks(masks, size_of_files, &listed);
  return listed;
}

py::dict dict_of(const Finding& finding) {
  py::dict dict;
  dict["kind"] = to_string(finding.kind);
  dict["images"] = finding.images;
  dict["k"] = finding.k;
  dict["n"] = finding.n;
  dict["p_value"] = finding.p_value;
  dict["disqualifying"] = finding.is_disqualifying;
  dict["text"] = finding.text;
  return dict;
}

py::array_t<float> positions_of(const std::vector<ColoredPoint>& points) {
  py::array_t<float> array({static_cast<py::ssize_t>(points.size()), py::ssize_t{3}});
  auto values = array.mutable_unchecked<2>();
  for (py::ssize_t i = 0; i < values.shape(0); ++i) {
    for (int k = 0; k < 3; ++k) values(i, k) = points[static_cast<std::size_t>(i)].x_in_map[k];
  }
  return array;
}

py::array_t<std::uint8_t> colours_of(const std::vector<ColoredPoint>& points) {
  py::array_t<std::uint8_t> array({static_cast<py::ssize_t>(points.size()), py::ssize_t{3}});
  auto values = array.mutable_unchecked<2>();
  for (py::ssize_t i = 0; i < values.shape(0); ++i) {
    const ColoredPoint& point = points[static_cast<std::size_t>(i)];
    values(i, 0) = point.r, values(i, 1) = point.g, values(i, 2) = point.b;
  }
  return array;
}

py::array_t<double> seconds_of(const std::vector<RegisteredFrame>& frames) {
  py::array_t<double> array(static_cast<py::ssize_t>(frames.size()));
  for (std::size_t i = 0; i < frames.size(); ++i) {
    array.mutable_at(static_cast<py::ssize_t>(i)) = 1e-9 * static_cast<double>(frames[i].stamp_ns);
  }
  return array;
}

DoubleArray poses_of(const std::vector<RegisteredFrame>& frames) {
  std::vector<Rigid3> poses;
  for (const RegisteredFrame& frame : frames) poses.push_back(frame.map_from_camera);
  return matrices_of(poses);
}

/// What reconstruct gives.
struct Reconstruction {
  RecordingResult recorded;
  std::vector<ColoredPoint> points;
  CameraParameters camera;
  CalibrationSource calibration = CalibrationSource::kGiven;

  std::vector<std::int64_t> indices() const {
    std::vector<std::int64_t> result;
    for (const RegisteredFrame& frame : recorded.trajectory) result.push_back(frame.index);
    return result;
  }
  std::vector<std::string> names() const {
    std::vector<std::string> result;
    for (const RegisteredFrame& frame : recorded.trajectory) result.push_back(recorded.names.at(frame.index));
    return result;
  }
  py::list findings() const {
    py::list list;
    if (recorded.maps.empty()) return list;
    for (const Finding& finding : recorded.maps.front().quality.findings()) list.append(dict_of(finding));
    return list;
  }
  const char* verdict() const {
    if (!recorded.tracked) return "no map";
    return is_confirmed(recorded) ? "confirmed" : "not confirmed";
  }
};

/// False of Python or of numpy; None and numbers are not.
bool is_false(const py::object& answer) {
  py::detail::make_caster<bool> flag;
  return flag.load(answer, false) && !static_cast<bool>(flag);
}

/// Asks the interpreter for signals, and the caller for whether to go on; an exception of either is kept and
/// ends the work.
class ProgressCall {
 public:
  ProgressCall(const py::object& call, int total) : call_(call), total_(total) {}

  void advance(std::int64_t done) {
    unless_ended([&] {
      if (!call_.is_none() && is_false(call_(done, total_))) ended_ = true;
    });
  }
  bool has_ended() {
    unless_ended([] {});
    return ended_;
  }
  void rethrow() const {
    if (error_) throw py::error_already_set(*error_);
  }

 private:
  template <typename Work>
  void unless_ended(const Work& work) {
    const py::gil_scoped_acquire lock;
    if (ended_) return;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      work();
    } catch (py::error_already_set& error) {
      error_ = std::make_unique<py::error_already_set>(error);
      ended_ = true;
    }
  }

  const py::object& call_;
  const int total_;
  std::atomic<bool> ended_{false};
  std::unique_ptr<py::error_already_set> error_;
};

std::unique_ptr<Reconstruction> reconstruct(const py::object& images, const CameraModel& camera,
                                            const py::object& masks, const py::object& options, int threads,
                                            const py::object& progress, bool refine_camera) {
  if (threads < 0 || threads > 256) {
    throw std::invalid_argument("threads = " + std::to_string(threads) + ": expected 0 (all cores) to 256");
  }
  Recording recording;
  recording.threads = threads == 0 ? std::min(256, processors()) : threads;
  if (is_path(images)) {
    if (!masks.is_none() && !is_path(masks)) {
      throw std::invalid_argument("masks: expected a folder, because images is a folder");
    }
    recording.open = [path = path_of(images)] { return open_images(path); };
  } else {
    const auto listed = std::make_shared<const std::vector<ListedImage>>(
        listed_images(images, masks, {camera.width(), camera.height()}));
    recording.open = [listed] { return std::make_unique<ListedSource>(listed); };
  }
  std::optional<MaskFolder> folder;
  if (is_path(masks)) recording.masks = &folder.emplace(path_of(masks));
  const TrackerOptions tracker_options = options_of(options).on_threads(recording.threads);
  ProgressCall call(progress, recording.open()->size());
  recording.interrupted = [&call] { return call.has_ended(); };
  auto result = std::make_unique<Reconstruction>();
  {
    const py::gil_scoped_release unlocked;
    const auto observer_of = [&](int) -> FrameObserver {
      return [&](int pass, std::int64_t index, const FrameReport&) {
        if (pass == 1) call.advance(index + 1);
      };
    };
    const RecordingCamera given{camera.parameters(), CalibrationSource::kGiven, refine_camera};
    TrackedRecording tracked = RecordingPipeline(recording, tracker_options, given, observer_of).run();
    result->recorded = std::move(tracked.result);
    result->camera = tracked.calibration.camera;
    result->calibration = tracked.calibration.source;
    if (!result->recorded.maps.empty()) result->points = result->recorded.maps.front().snapshot->points;
    recording.open = nullptr;
  }
  call.rethrow();
  return result;
}

/// A tracker of a live camera, whose mapper has a thread of its own. Calls from several threads wait for each
/// other.
class LiveTracker {
 public:
  LiveTracker(const CameraModel& camera, const py::object& options)
      : tracker_(std::make_unique<Tracker>(options_of(options), camera, Tracker::Mapping::kThreaded)) {}
  ~LiveTracker() {
    const py::gil_scoped_release unlocked;  // its threads may let go of arrays
    tracker_.reset();
  }
  LiveTracker(const LiveTracker&) = delete;
  LiveTracker& operator=(const LiveTracker&) = delete;

  FrameReport track(double stamp, const py::object& image, const py::object& mask) {
    if (!std::isfinite(stamp) || std::abs(stamp) > 9e9) {
      throw std::invalid_argument("stamp: expected seconds, up to 9e9");
    }
    const cv::Mat pixels = image_of(image, "image"), used = mask_of(mask, "mask", pixels.size());
    const py::gil_scoped_release unlocked;
    const std::lock_guard<std::mutex> lock(mutex_);
    return tracker_->process(static_cast<std::int64_t>(std::llround(stamp * 1e9)), pixels, used);
  }
  void reset() {
    const py::gil_scoped_release unlocked;
    const std::lock_guard<std::mutex> lock(mutex_);
    tracker_->reset();
  }
  void wait() {
    const py::gil_scoped_release unlocked;
    const std::lock_guard<std::mutex> lock(mutex_);
    tracker_->wait();
  }
  std::vector<ColoredPoint> points() const {
    const py::gil_scoped_release unlocked;
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::shared_ptr<const MapSnapshot> snapshot = tracker_->snapshot();
    return snapshot ? snapshot->points : std::vector<ColoredPoint>();
  }
  std::vector<RegisteredFrame> trajectory() const {
    const py::gil_scoped_release unlocked;
    const std::lock_guard<std::mutex> lock(mutex_);
    return tracker_->trajectory();
  }

 private:
  mutable std::mutex mutex_;  // taken without the GIL
  std::unique_ptr<Tracker> tracker_;
};

void bind_status(py::module_& module) {
  py::class_<FrameReport>(module, "Status", "The result of tracking one image.")
      .def_property_readonly(
          "state", [](const FrameReport& r) { return to_string(r.state); },
          "TRACKING, LOST, BOOTSTRAPPING, ...")
      .def_property_readonly(
          "reason", [](const FrameReport& r) { return to_string(r.reason); }, "OK, TOO_FEW_MATCHES, ...")
      .def_readonly("text", &FrameReport::reason_text, "the reason with its numbers, one line")
      .def_property_readonly(
          "pose",
          [](const FrameReport& r) -> py::object {
            if (!r.map_from_camera) return py::none();
            return matrix_of(*r.map_from_camera);
          },
          "map_from_camera (4, 4) in map units; None if the image has no pose")
      .def_readonly("is_keyframe", &FrameReport::is_keyframe,
                    "whether the mapper takes the image as a keyframe")
      .def_readonly("features", &FrameReport::features, "number of features in the image")
      .def_readonly("matches", &FrameReport::matches, "number of features matched to landmarks")
      .def_readonly("inliers", &FrameReport::inliers, "number of matches that agree with the pose")
      .def_readonly("keyframes", &FrameReport::keyframes, "number of keyframes of the map")
      .def_readonly("landmarks", &FrameReport::landmarks, "number of landmarks of the map")
      .def_readonly("reprojection_rms_px", &FrameReport::reprojection_rms_px,
                    "RMS of the inliers' reprojection errors, px")
      .def_readonly("epoch", &FrameReport::epoch, "counts maps")
      .def_readonly("map_id", &FrameReport::map_id, "id of the map that the pose is in; 0: no pose")
      .def("__repr__", [](const FrameReport& r) {
        return std::string("Status(") + to_string(r.state) + ", " + to_string(r.reason) + ", " +
               std::to_string(r.inliers) + " inliers)";
      });
}

}  // namespace

void bind_tracking(py::module_& module) {
  bind_status(module);
  py::class_<LiveTracker>(module, "Tracker", "Tracks a live camera against the map that it builds.")
      .def(py::init<const CameraModel&, const py::object&>(), py::arg("camera"),
           py::arg("options") = py::none(), "options: as in reconstruct.")
      .def("track", &LiveTracker::track, py::arg("stamp"), py::arg("image"), py::arg("mask") = py::none(),
           "Tracks the next image. stamp: seconds, increasing. image: uint8 (h, w) or (h, w, 3), blue first; "
           "its memory is shared if its rows are contiguous, and must not change during the call. mask: "
           "uint8 or bool (h, w), 0 = ignore. Releases the GIL; calls from several threads wait for each "
           "other.")
      .def("reset", &LiveTracker::reset, "Drops the map.")
      .def("wait", &LiveTracker::wait, "Waits until the mapper has no work left.")
      .def_property_readonly(
          "points", [](const LiveTracker& t) { return positions_of(t.points()); }, "(n, 3) in map units")
      .def_property_readonly(
          "colours", [](const LiveTracker& t) { return colours_of(t.points()); }, "(n, 3), red first")
      .def_property_readonly(
          "poses", [](const LiveTracker& t) { return poses_of(t.trajectory()); },
          "map_from_camera (n, 4, 4) of every tracked image, with all corrections so far")
      .def_property_readonly(
          "stamps", [](const LiveTracker& t) { return seconds_of(t.trajectory()); }, "(n,) s, of poses");
  py::class_<Reconstruction>(module, "Result", "The result of reconstruct: the largest map and its images.")
      .def_property_readonly(
          "poses", [](const Reconstruction& r) { return poses_of(r.recorded.trajectory); },
          "map_from_camera (n, 4, 4) in map units, of the registered images in order")
      .def_property_readonly(
          "stamps", [](const Reconstruction& r) { return seconds_of(r.recorded.trajectory); }, "(n,) s")
      .def_property_readonly("indices", &Reconstruction::indices,
                             "indices of the registered images among all images")
      .def_property_readonly("names", &Reconstruction::names, "names of the registered images")
      .def_property_readonly(
          "points", [](const Reconstruction& r) { return positions_of(r.points); }, "(m, 3) in map units")
      .def_property_readonly(
          "colours", [](const Reconstruction& r) { return colours_of(r.points); }, "(m, 3), red first")
      .def_property_readonly(
          "camera", [](const Reconstruction& r) { return CameraModel(r.camera); },
          "the camera of the map: the refined one, or the given one")
      .def_property_readonly(
          "calibration", [](const Reconstruction& r) { return to_string(r.calibration); },
          "REFINED where the camera was refined, else GIVEN")
      .def_property_readonly("findings", &Reconstruction::findings,
                             "dicts of kind, images, k, n, p_value, disqualifying, text")
      .def_property_readonly("verdict", &Reconstruction::verdict, "confirmed, not confirmed or no map")
      .def_property_readonly(
          "reason", [](const Reconstruction& r) { return r.recorded.reason; }, "why there is no map")
      .def_property_readonly(
          "warnings", [](const Reconstruction& r) { return r.recorded.warnings; },
          "reasons to doubt the result, and what to do")
      .def_property_readonly(
          "problems", [](const Reconstruction& r) { return r.recorded.problems; },
          "excluded images and missing masks, one line each")
      .def_property_readonly(
          "frames_total", [](const Reconstruction& r) { return r.recorded.frames_total; },
          "number of readable images, registered or not");
  module.def(
      "reconstruct", &reconstruct, py::arg("images"), py::arg("camera"), py::arg("masks") = py::none(),
      py::arg("options") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
      py::arg("refine_camera") = false,
      "Tracks all images and returns the finished map. images: a folder, a list file, or a sequence of paths "
      "or arrays, uint8 (h, w) or (h, w, 3), blue first. masks: a folder, or a sequence of paths, arrays "
      "(h, w) or None; 0 = ignore. options: a dict of \"group/key\" to values as in tracker.yaml, or the "
      "path of such "
      "a file. threads: 0 for all cores; the result is the same for any number. progress(done, total): "
      "called after each image; return False to stop. refine_camera: estimate focal length, principal point "
      "and distortion from the images, which are tracked several times; result.camera has them. Releases the "
      "GIL.");
}

}  // namespace mono_pose_tracker
