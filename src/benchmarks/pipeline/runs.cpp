#include "runs.h"

#include <cv_bridge/cv_bridge.h>
#include <malloc.h>
#include <sensor_msgs/image_encodings.h>
#include <time.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>

#include "evaluation/doubt_error.h"
#include "mono_pose_tracker/evaluation/trajectory_error.h"
#include "pipeline/recording.h"
#include "ros/camera_info.h"
#include "ros/image_conversion.h"
#include "tools/json.h"

namespace mono_pose_tracker {
namespace {

class MemorySource : public ImageSource {
 public:
  explicit MemorySource(const DecodedSequence& sequence) : frames_(sequence.frames) {}

  SourceImage next() override {
    SourceImage image;
    if (next_ == frames_.size()) return image;
    const DecodedFrame& frame = frames_[next_++];
    image.kind = SourceImage::Kind::kImage;
    image.stamp_ns = frame.stamp_ns;
    image.name = frame.name;
    image.image = frame.image;
    return image;
  }
  int size() const override { return static_cast<int>(frames_.size()); }

 private:
  const std::vector<DecodedFrame>& frames_;
  std::size_t next_ = 0;
};

std::string size_text(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

}  // namespace

DecodedFrame make_decoded_frame(std::int64_t stamp_ns, const std::string& name, const cv::Mat& image) {
  namespace enc = sensor_msgs::image_encodings;
  std_msgs::Header header;
  header.frame_id = "camera_optical";
  header.stamp.fromNSec(static_cast<std::uint64_t>(stamp_ns));
  DecodedFrame frame;
  frame.stamp_ns = stamp_ns;
  frame.name = name;
  frame.message =
      cv_bridge::CvImage(header, image.channels() == 1 ? enc::MONO8 : enc::BGR8, image).toImageMsg();
  frame.image = convert_image(frame.message).image;
  return frame;
}

DecodedSequence decode_images(const std::string& path, int max_frames, const CameraParameters& camera) {
  DecodedSequence sequence;
  const std::unique_ptr<ImageSource> source = open_images(path);
  while (max_frames < 0 || static_cast<int>(sequence.frames.size()) < max_frames) {
    const SourceImage next = source->next();
    if (next.kind == SourceImage::Kind::kEnd) break;
    if (next.kind == SourceImage::Kind::kSkipped) {
      sequence.problems.push_back(next.problem);
      continue;
    }
    if (next.image.cols != camera.width || next.image.rows != camera.height) {
      const std::string problem = next.name + ": is " + size_text(next.image.cols, next.image.rows) +
                                  ", the calibration is for " + size_text(camera.width, camera.height);
      if (sequence.frames.empty()) throw std::runtime_error(problem);
      sequence.problems.push_back(problem);
      continue;
    }
    sequence.frames.push_back(make_decoded_frame(next.stamp_ns, next.name, next.image));
  }
  if (sequence.frames.empty()) {
    throw std::runtime_error("no image could be read: " +
                             (sequence.problems.empty() ? "there is none" : sequence.problems.front()));
  }
  return sequence;
}

std::unique_ptr<ImageSource> make_source(const DecodedSequence& sequence) {
  return std::make_unique<MemorySource>(sequence);
}

namespace {

double status_mb(const std::string& key) {
  std::ifstream status("/proc/self/status");
  std::string line;
  while (std::getline(status, line)) {
    if (line.rfind(key, 0) == 0) return std::stod(line.substr(key.size())) / 1024;  // given in kB
  }
  return 0;
}

double clock_ms(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

}  // namespace

double resident_mb() { return status_mb("VmRSS:"); }

double peak_resident_mb() { return status_mb("VmHWM:"); }

void restart_peak() { std::ofstream("/proc/self/clear_refs") << "5"; }

double thread_cpu_ms() { return clock_ms(CLOCK_THREAD_CPUTIME_ID); }

double process_cpu_ms() { return clock_ms(CLOCK_PROCESS_CPUTIME_ID); }

namespace {

double ms_between(LivePipeline::Clock::time_point from, LivePipeline::Clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

}  // namespace

LivePipeline::LivePipeline(const TrackerOptions& options, const CameraParameters& camera, Observer observer)
    : tracker_(
          options, cameras_, masks_, std::chrono::milliseconds(0), [] { return false; },
          [](const std::string&, const std::string&) {}),
      observer_(std::move(observer)) {
  // As a driver sends it: a file would only be used once no message has come for a while.
  cameras_.set_message(boost::make_shared<sensor_msgs::CameraInfo>(to_camera_info(camera)));
  thread_ = std::thread([this] { run(); });
}

LivePipeline::~LivePipeline() {
  slot_.close();
  thread_.join();
}

void LivePipeline::put(const sensor_msgs::ImageConstPtr& image, std::optional<std::int64_t> due_ns) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counts_.received;
  }
  const Clock::time_point arrival = Clock::now();
  if (due_ns) tracker_.note_arrival(*due_ns, arrival);
  if (!slot_.put({image, arrival, due_ns.has_value()})) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  ++counts_.dropped;
  done_.notify_all();
}

void LivePipeline::wait() {
  std::unique_lock<std::mutex> lock(mutex_);
  done_.wait(lock, [this] { return counts_.tracked + counts_.dropped == counts_.received; });
}

LivePipeline::Counts LivePipeline::counts() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return counts_;
}

std::vector<RegisteredFrame> LivePipeline::trajectory_on_final_map() {
  tracker_.wait_for_mapping();
  return tracker_.trajectory();
}

void LivePipeline::run() {
  while (const std::optional<Frame> frame = slot_.take()) {
    const Clock::time_point start = Clock::now();
    const FrameReport report = tracker_.process(frame->image, frame->arrival);
    const Clock::time_point end = Clock::now();
    if (!frame->in_time) tracker_.wait_for_mapping();
    observer_(report, ms_between(start, end), ms_between(frame->arrival, end));
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counts_.tracked;
    done_.notify_all();
  }
}

namespace {

using Clock = LivePipeline::Clock;

// Largest difference of the stamps of one frame: those of lists are rounded differently.
constexpr std::int64_t kMaxStampDifference = 10'000'000;  // ns

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Resident memory before, at most and after: what earlier runs left is handed back first.
class MemoryWatch {
 public:
  MemoryWatch() {
    malloc_trim(0);
    restart_peak();
    before_ = resident_mb();
  }
  Json result() const {
    return {{"before", before_}, {"peak", peak_resident_mb()}, {"after", resident_mb()}};
  }

 private:
  double before_ = 0;
};

/// Nothing without a reference, or with too few registered frames.
std::optional<TrajectoryError> error_of(const std::vector<StampedPose>& reference,
                                        const std::vector<StampedPose>& estimate) {
  if (reference.empty()) return std::nullopt;
  try {
    return evaluate_trajectory(reference, estimate, kMaxStampDifference);
  } catch (const std::runtime_error&) {
    return std::nullopt;
  }
}

std::vector<StampedPose> stamped(const std::vector<RegisteredFrame>& frames) {
  std::vector<StampedPose> poses;
  for (const RegisteredFrame& frame : frames) poses.push_back({frame.stamp_ns, frame.map_from_camera});
  return poses;
}

Json position_error_percent(const std::vector<StampedPose>& reference,
                            const std::vector<StampedPose>& estimate) {
  const std::optional<TrajectoryError> error = error_of(reference, estimate);
  return error ? Json(error->position_rmse_percent) : nullptr;
}

/// Of the poses that lie far from the offline ones: how many were reported as doubtful.
Json doubts(const std::vector<StampedPose>& offline, const std::vector<ReportedPose>& reported) {
  int off = 0, off_and_told = 0, told = 0;
  const std::vector<PoseDeviation> deviations = deviations_of(offline, reported);
  for (const PoseDeviation& deviation : deviations) {
    off += deviation.off;
    off_and_told += deviation.off && deviation.doubtful;
    told += deviation.doubtful;
  }
  return {{"poses_compared", deviations.size()},
          {"poses_off", off},
          {"poses_off_doubtful", off_and_told},
          {"poses_doubtful", told}};
}

/// As they came, each map by itself: each has a frame and a unit of its own, and poses of two are no path.
std::map<std::uint32_t, std::vector<StampedPose>> by_map(const std::vector<ReportedPose>& reported) {
  std::map<std::uint32_t, std::vector<StampedPose>> poses;
  for (const ReportedPose& pose : reported)
    poses[pose.map_id].push_back({pose.stamp_ns, pose.map_from_camera});
  return poses;
}

std::vector<StampedPose> poses_in_largest_map(const std::vector<ReportedPose>& reported) {
  std::vector<StampedPose> largest;
  for (const auto& of_map : by_map(reported)) {
    if (of_map.second.size() > largest.size()) largest = of_map.second;
  }
  return largest;
}

Json live_maps(const std::vector<StampedPose>& reference, const std::vector<ReportedPose>& reported) {
  std::map<std::uint32_t, int> doubtful;
  for (const ReportedPose& pose : reported) doubtful[pose.map_id] += pose.doubtful;
  Json maps = Json::array();
  for (const auto& [id, of_map] : by_map(reported)) {
    Json map = {{"map_id", id}, {"frames", of_map.size()}, {"doubtful", doubtful[id]}};
    const std::optional<TrajectoryError> error = error_of(reference, of_map);
    map["position_rmse_percent"] = error ? Json(error->position_rmse_percent) : nullptr;
    map["rotation_median_deg"] = error ? Json(error->rotation_median_deg) : nullptr;
    maps.push_back(map);
  }
  return maps;
}

/// What is gathered from the frames' reports.
struct Gathered {
  std::vector<double> frame_ms, cpu_ms;
  std::map<std::string, std::vector<double>> stage_ms;
  std::vector<ReportedPose> reported;
  std::map<std::string, int> reasons;  // how many images each was given for
  int backlog_max = 0;
  FrameReport last;
  double cpu_then = 0;  // of the thread, when the frame before was done

  /// Called on the thread that tracks.
  void add(const FrameReport& report, double ms) {
    frame_ms.push_back(ms);
    const double cpu_now = thread_cpu_ms();
    cpu_ms.push_back(cpu_now - std::exchange(cpu_then, cpu_now));
    for (const auto& [stage, stage_time] : report.stages) stage_ms[stage].push_back(stage_time);
    if (report.map_from_camera) {
      reported.push_back(
          {report.stamp_ns, report.map_id, *report.map_from_camera, report.reason == Reason::kDoubtfulPose});
    }
    ++reasons[to_string(report.reason)];
    backlog_max = std::max(backlog_max, report.worker_backlog);
    last = report;
  }
};

}  // namespace

Json run_offline(const RunInput& input, std::vector<StampedPose>* trajectory) {
  const MemoryWatch memory;
  Tracker tracker(input.options, CameraModel(input.camera), Tracker::Mapping::kInline);
  Recording recording;
  recording.open = [&] { return make_source(input.sequence); };
  Gathered gathered;
  const double cpu_before_ms = process_cpu_ms();
  const Clock::time_point start = Clock::now();
  Clock::time_point last = start;
  gathered.cpu_then = thread_cpu_ms();
  const FrameObserver observer = [&](int pass, std::int64_t, const FrameReport& report) {
    if (pass != 1) return;
    gathered.add(report, ms_since(last));
    last = Clock::now();
  };
  const RecordingResult result = track_recording(recording, observer, &tracker);
  const double seconds = 1e-3 * ms_since(start), cpu_seconds = 1e-3 * (process_cpu_ms() - cpu_before_ms);
  *trajectory = stamped(result.trajectory);
  const std::vector<StampedPose> largest = poses_in_largest_map(gathered.reported);
  const auto registered = static_cast<std::int64_t>(result.trajectory.size());
  return {{"frames_total", result.frames_total},
          {"frames_posed", registered},
          {"frames_not_posed", result.frames_total - registered},
          {"frames_posed_as_they_came", result.frames_posed_live},
          {"seconds", seconds},
          {"cpu_seconds", cpu_seconds},
          {"frame", time_statistics(gathered.frame_ms)},
          {"frame_cpu", time_statistics(gathered.cpu_ms)},
          {"stages", time_statistics(gathered.stage_ms)},
          {"keyframes", tracker.map().keyframes().size()},
          {"landmarks", tracker.map().landmarks().size()},
          {"memory_mb", memory.result()},
          {"position_rmse_percent", position_error_percent(input.reference, *trajectory)},
          {"position_rmse_percent_as_they_came", position_error_percent(input.reference, largest)}};
}

Json run_live(const RunInput& input, double rate_hz, const std::vector<StampedPose>& offline) {
  const MemoryWatch memory;
  Gathered gathered;
  std::vector<double> latency_ms;
  int load_level_max = 0;
  LivePipeline pipeline(input.options, input.camera,
                        [&](const FrameReport& report, double ms, double latency) {
                          gathered.add(report, ms);
                          latency_ms.push_back(latency);
                          load_level_max = std::max(load_level_max, report.load_level);
                        });
  const Clock::time_point start = Clock::now();
  for (std::size_t i = 0; i < input.sequence.frames.size(); ++i) {
    const std::chrono::duration<double> due(static_cast<double>(i) / rate_hz);
    std::this_thread::sleep_until(start + std::chrono::duration_cast<Clock::duration>(due));
    pipeline.put(input.sequence.frames[i].message, static_cast<std::int64_t>(1e9 * due.count()));
  }
  pipeline.wait();
  const LivePipeline::Counts counts = pipeline.counts();
  const int registered = static_cast<int>(gathered.reported.size());
  const std::vector<StampedPose> largest = poses_in_largest_map(gathered.reported);
  const std::vector<StampedPose> on_final_map = stamped(pipeline.trajectory_on_final_map());
  Json result = {
      {"rate_hz", rate_hz},
      {"frames_total", counts.received},
      {"frames_posed", registered},
      {"frames_not_posed", counts.tracked - registered},
      {"frames_posed_in_other_maps", registered - static_cast<int>(largest.size())},
      {"frames_dropped", counts.dropped},
      {"seconds", 1e-3 * ms_since(start)},
      {"latency", time_statistics(latency_ms)},
      {"frame", time_statistics(gathered.frame_ms)},
      {"frame_cpu", time_statistics(gathered.cpu_ms)},
      {"stages", time_statistics(gathered.stage_ms)},
      {"backlog_max", gathered.backlog_max},
      {"load_level_max", load_level_max},
      {"keyframes", gathered.last.keyframes},
      {"landmarks", gathered.last.landmarks},
      {"memory_mb", memory.result()},
      {"position_rmse_percent", position_error_percent(input.reference, largest)},
      {"position_rmse_percent_on_final_map", position_error_percent(input.reference, on_final_map)},
      {"position_percent_from_offline", position_error_percent(offline, on_final_map)},
      {"maps", live_maps(input.reference, gathered.reported)},
      {"reasons", gathered.reasons}};
  if (!offline.empty()) result["doubt"] = doubts(offline, gathered.reported);
  return result;
}

Json median_run(std::vector<Json> runs) {
  const auto median_ms = [](const Json& run) { return run.at("frame").at("median_ms").get<double>(); };
  std::sort(runs.begin(), runs.end(),
            [&](const auto& a, const auto& b) { return median_ms(a) < median_ms(b); });
  Json all = Json::array();
  for (const auto& run : runs) all.push_back(median_ms(run));
  Json middle = runs[(runs.size() - 1) / 2];
  middle["median_ms_of_runs"] = std::move(all);
  return middle;
}

}  // namespace mono_pose_tracker
