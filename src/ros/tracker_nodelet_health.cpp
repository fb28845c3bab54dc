// Health checks of TrackerNodelet: missing inputs, output errors, diagnostics.

#include <cstdio>

#include "camera/camera_parameters.h"
#include "ros/diagnostics.h"
#include "ros/paths.h"
#include "ros/tracker_nodelet.h"

namespace mono_pose_tracker {
namespace {

double seconds_since(StatusBoard::Clock::time_point then) {
  return std::chrono::duration<double>(StatusBoard::Clock::now() - then).count();
}

// Advice if the topic is that of a transport instead of the images' own.
std::string transport_hint(const std::string& topic) {
  const auto slash = topic.rfind('/');
  const std::string last = topic.substr(slash + 1);
  if (slash == std::string::npos || (last != "compressed" && last != "theora" && last != "compressedDepth"))
    return "";
  return ": this is the topic of an image transport; give the base topic, image:=" + topic.substr(0, slash) +
         " (in launch files image_topic:=), with image_transport:=" + last;
}

}  // namespace

// Once, as soon as there is a calibration.
void TrackerNodelet::check_calibration() {
  if (is_calibration_checked_) return;
  const std::optional<ConvertedCamera> camera = cameras_->wait(std::chrono::milliseconds(0));
  if (!camera || camera->reason != Reason::kOk) return;
  is_calibration_checked_ = true;
  const std::string problem = rectification_contradiction(
      parameters_.rectified, getNodeHandle().resolveName("image"), camera->has_distortion);
  if (!problem.empty()) NODELET_WARN("%s", problem.c_str());
  if (!camera->note.empty()) NODELET_INFO("calibration: %s", camera->note.c_str());
}

void TrackerNodelet::check_inputs() {
  input_problem_.clear();
  check_calibration();
  if (seconds_since(board_->summary().last_arrival) > parameters_.input_timeout) {
    const std::string topic = image_subscriber_.topic();
    input_problem_ = "no image on " + topic;
    if (image_subscriber_.publishers() > 0) {
      input_problem_ += " although it is published";
    } else if (board_->summary().last.frames_received > 0) {
      input_problem_ += " any more: its publisher has gone";
    } else {
      const std::string hint = parameters_.image_transport == "raw" ? transport_hint(topic) : std::string();
      input_problem_ += hint.empty() ? ": nobody publishes it (remap image, or set ~image_transport)" : hint;
    }
  } else if (!cameras_->has_calibration() && board_->summary().last.frames_received > 0) {
    input_problem_ =
        "no camera_info on " + camera_info_subscriber_.getTopic() + " for the images on " +
        image_subscriber_.topic() +
        ": publish it in the same namespace, or give a calibration file by ~camera_info_url. To calibrate: "
        "rosrun camera_calibration cameracalibrator.py --size 8x6 --square 0.025 image:=" +
        image_subscriber_.topic();
    if (seconds_since(started_) < parameters_.input_timeout) return;
  }
  const bool has_no_clock = ros::Time::isSimTime() && ros::Time::now().isZero();
  if (has_no_clock && seconds_since(started_) > parameters_.input_timeout && input_throttle_.due("clock")) {
    NODELET_WARN(
        "use_sim_time is true, but there is no time on /clock: a bag must be played with --clock, and with a "
        "camera use_sim_time must be false (rosparam set use_sim_time false, then restart)");
  }
  if (!input_problem_.empty() && input_throttle_.due("input")) NODELET_WARN("%s", input_problem_.c_str());
}

void TrackerNodelet::check_outputs() {
  if (!trajectory_) return;
  trajectory_->retry();
  if (trajectory_->renewals() > told_renewals_) {
    told_renewals_ = trajectory_->renewals();
    NODELET_WARN("%s was moved or removed: later poses are written to a new file",
                 expand_path(parameters_.trajectory_file).c_str());
  }
  const std::string problem = trajectory_->problem();
  if (problem.empty() && !output_problem_.empty()) NODELET_INFO("the trajectory file can be written again");
  if (!problem.empty() && input_throttle_.due("output")) NODELET_ERROR("%s", problem.c_str());
  output_problem_ = problem;
}

void TrackerNodelet::diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) {
  const StatusBoard::Summary summary = board_->summary();
  Health health;
  health.last = summary.last;
  health.seconds_since_image = seconds_since(summary.last_arrival);
  health.frames_per_second = summary.frames_per_second;
  health.input_problem = input_problem_;
  health.output_problem = output_problem_;
  health.calibration = describe_calibration();
  health.recent_frames = summary.last.frames_received - diagnosed_.frames_received;
  health.recent_drops = summary.last.frames_dropped - diagnosed_.frames_dropped;
  diagnosed_ = summary.last;
  health.memory = memory_use();
  if (health.memory) {
    health.bytes_per_keyframe = keyframe_memory_.bytes_per_keyframe(
        health.memory->resident, summary.last.map_id, summary.last.keyframes);
  }
  {
    const boost::recursive_mutex::scoped_lock lock(live_mutex_);
    health.is_map_limited = live_options_.tracker.mapping.max_keyframes > 0;
  }
  fill_diagnostics(health, status);
}

std::string TrackerNodelet::describe_calibration() const {
  const std::optional<ConvertedCamera> camera = cameras_->wait(std::chrono::milliseconds(0));
  if (!camera || camera->reason != Reason::kOk) return "";
  const CameraParameters& p = camera->parameters;
  char text[96];
  std::snprintf(text, sizeof text, "%dx%d, focal length %.1f px, from ", p.width, p.height, p.fx);
  if (camera->source == CalibrationSource::kGuessed) return std::string(text) + "the guess ~hfov";
  return text + (cameras_->is_calibrated_by_message() ? camera_info_subscriber_.getTopic()
                                                      : parameters_.camera_info_url);
}

}  // namespace mono_pose_tracker
