#include "ros/status_board.h"

#include <utility>

#include "ros/messages.h"

namespace mono_pose_tracker {

StatusBoard::StatusBoard(ros::NodeHandle private_handle, Rectification rectification)
    : rectification_(std::move(rectification)),
      // Nobody should miss the answer to an image: room for some seconds of them.
      publisher_(private_handle.advertise<TrackerStatus>("status", 200)) {
  FrameReport start;
  start.state = State::kWaitingForCameraInfo;
  summary_.last = to_status(start);
  summary_.last_arrival = Clock::now();
}

void StatusBoard::count_received() {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Clock::time_point now = Clock::now();
  const double seconds = std::chrono::duration<double>(now - summary_.last_arrival).count();
  summary_.last_arrival = now;
  if (received_++ == 0 || seconds <= 0) return;
  double& rate = summary_.frames_per_second;
  rate += (rate > 0 ? 0.1 : 1.0) * (1 / seconds - rate);
}

void StatusBoard::publish(const std_msgs::Header& header, const FrameReport& report,
                          Clock::time_point arrival) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (report.map_from_camera) ++registered_;
  state_ = report.state;
  publish_locked(to_status(report), header, arrival);
}

void StatusBoard::publish_unprocessed(const std_msgs::Header& header, Reason reason, const std::string& text,
                                      Clock::time_point arrival) {
  const std::lock_guard<std::mutex> lock(mutex_);
  FrameReport report;
  report.state = reason == Reason::kPaused ? State::kPaused : state_;
  report.reason = reason;
  report.reason_text = text;
  report.epoch = summary_.last.epoch;
  report.map_id = summary_.last.map_id;
  report.corrections = summary_.last.corrections;
  report.load_level = summary_.last.load_level;
  report.calibration = static_cast<CalibrationSource>(summary_.last.calibration);
  report.keyframes = static_cast<int>(summary_.last.keyframes);
  report.landmarks = static_cast<int>(summary_.last.landmarks);
  report.scale = static_cast<ScaleSource>(summary_.last.scale);
  const bool is_excluded = reason == Reason::kDropped || reason == Reason::kStaleStamp;
  if (is_excluded) ++dropped_;
  const TrackerStatus processed = summary_.last;
  publish_locked(to_status(report), header, arrival);
  if (!is_excluded) return;
  // An excluded image has no information on tracking: the summary stays that of the last processed image.
  summary_.last = processed;
  summary_.last.frames_received = received_;
  summary_.last.frames_dropped = dropped_;
}

void StatusBoard::note(State state, std::uint32_t epoch) {
  const std::lock_guard<std::mutex> lock(mutex_);
  state_ = state;
  summary_.last.epoch = epoch;
  summary_.last.map_id = summary_.last.corrections = 0;
  summary_.last.keyframes = summary_.last.landmarks = 0;
  summary_.last.scale = TrackerStatus::MAP_UNITS;
  summary_.last.scale_name = to_string(ScaleSource::kMapUnits);
}

StatusBoard::Summary StatusBoard::summary() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return summary_;
}

void StatusBoard::publish_locked(TrackerStatus status, const std_msgs::Header& header,
                                 Clock::time_point arrival) {
  status.header = header;
  status.frames_received = received_;
  status.frames_posed = registered_;
  status.frames_dropped = dropped_;
  status.rectified = rectification_.is_rectified;
  status.rectified_reason = rectification_.reason;
  status.latency_ms =
      static_cast<float>(std::chrono::duration<double, std::milli>(Clock::now() - arrival).count());
  publisher_.publish(status);
  summary_.last = std::move(status);
}

}  // namespace mono_pose_tracker
