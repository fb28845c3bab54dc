#include "live_pipeline.h"

#include <boost/make_shared.hpp>

#include "ros/camera_info_conversion.h"

namespace mono_pose_tracker {
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

}  // namespace mono_pose_tracker
