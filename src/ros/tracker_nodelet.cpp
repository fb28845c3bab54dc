#include "ros/tracker_nodelet.h"

#include <image_transport/camera_common.h>

#include <algorithm>
#include <cstdio>
#include <future>
#include <memory>
#include <pluginlib/class_list_macros.hpp>
#include <stdexcept>
#include <utility>

#include "camera/camera_parameters.h"
#include "mono_pose_tracker/io/map_file.h"
#include "ros/camera_info.h"
#include "ros/diagnostics.h"
#include "ros/messages.h"
#include "ros/parameters.h"
#include "ros/reporting.h"
#include "tracking/background_image.h"

namespace mono_pose_tracker {
namespace {

std::string format_seconds(double seconds) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.3f s", seconds);
  return text;
}

/// The camera_info beside the image, unless the user has remapped camera_info.
std::string camera_info_topic(const ros::NodeHandle& handle, const std::string& image_topic) {
  std::string remapped = handle.resolveName("camera_info");
  if (remapped != handle.resolveName("camera_info", false)) return remapped;
  return image_transport::getCameraInfoTopic(handle.resolveName(image_topic));
}

}  // namespace

TrackerNodelet::~TrackerNodelet() { tear_down(); }

void TrackerNodelet::tear_down() {
  stopping_ = true;
  if (slot_) slot_->close();  // services that wait for their turn give up
  // Whatever the options: the image and the mapping under way end soon.
  if (tracker_) tracker_->cancel();
  if (frames_) frames_->cancel();
  // Each of these returns when its callbacks under way have: none may meet a nodelet half gone.
  services_.clear();
  live_server_.reset();
  service_spinner_.stop();
  timer_.stop();  // it asks the subscribers
  tf_timer_.stop();
  diagnostics_.reset();
  image_subscriber_ = ImageSubscriber();
  camera_info_subscriber_.shutdown();
  mask_subscriber_.shutdown();
  initialpose_subscriber_.shutdown();
  if (processing_.joinable()) processing_.join();
  publishers_.reset();
  frames_.reset();
  board_.reset();
}

void TrackerNodelet::onInit() {
  try {
    set_up();
  } catch (const std::exception& e) {
    NODELET_FATAL("%s", e.what());
    // The loader drops the callback queue before the nodelet: no publisher or subscriber may outlive it.
    tear_down();
    throw;  // the loader says that the nodelet could not be loaded
  }
}

void TrackerNodelet::set_up() {
  parameters_ = read_parameters(getPrivateNodeHandle());
  const NodeParameters& p = parameters_;
  for (const std::string& warning : p.warnings) NODELET_WARN("%s", warning.c_str());
  NODELET_INFO("parameters: %s", p.effective.c_str());
  read_background_image(p.tracker.segmentation);  // refused now, not image by image
  const Rectification rectification = decide_rectification(p.rectified, getNodeHandle().resolveName("image"));
  NODELET_INFO("the images are treated as %s: %s", rectification.is_rectified ? "rectified" : "raw",
               rectification.reason.c_str());
  cameras_ = std::make_unique<CameraSource>(rectification.is_rectified, p.hfov, p.camera_info_source);
  if (!p.camera_info_url.empty()) cameras_->set_file(load_camera_info(p.camera_info_url));
  if (!p.trajectory_file.empty()) {
    trajectory_ = std::make_unique<TrajectoryLog>(expand_path(p.trajectory_file));
  }
  board_ = std::make_unique<StatusBoard>(getPrivateNodeHandle(), rectification);
  frames_ =
      std::make_unique<OutputFrames>(p.frames, [this](const std::string& subject, const std::string& text) {
        if (throttle_.due(subject)) NODELET_ERROR("%s", text.c_str());
      });
  publishers_ = std::make_unique<Publishers>(*frames_, p.path_max_length, getPrivateNodeHandle(),
                                             [this](const std::string& text) { complain("listener", text); });
  time_guard_ = std::make_unique<TimeGuard>(static_cast<std::int64_t>(1e9 * p.time_jump));
  slot_ = std::make_unique<ImageSlot<Frame>>(static_cast<std::size_t>(p.queue_size),
                                             [this](const std::string& text) { complain("command", text); });
  tracker_ = std::make_unique<LiveTracker>(
      p.tracker, *cameras_, masks_, std::chrono::milliseconds(static_cast<int>(1e3 * p.mask_timeout)),
      [this] { return mask_subscriber_.getNumPublishers() > 0; },
      [this](const std::string& subject, const std::string& text) {
        if (throttle_.due(subject)) NODELET_WARN("%s", text.c_str());
      },
      GreyLevelChoice(p.grey_levels));
  if (p.load_map_at_start) load_map_at_start();
  placement_ = std::make_unique<MapPlacement>(p.tracker.scale.odometry, *frames_, *tracker_);
  subscribe();
  processing_ = std::thread([this] { process_images(); });
  advertise_services();
  timer_ = getPrivateNodeHandle().createWallTimer(ros::WallDuration(p.publish_period),
                                                  [this](const ros::WallTimerEvent&) { on_timer(); });
  diagnostics_ = std::make_unique<WallClockUpdater>(
      getNodeHandle(), getPrivateNodeHandle(), getName(), "none", "tracker",
      [this](diagnostic_updater::DiagnosticStatusWrapper& status) { diagnose(status); });
  if (!p.frames.odom_frame.empty() && p.frames.tf_rate > 0) {
    tf_timer_ = getPrivateNodeHandle().createWallTimer(
        ros::WallDuration(1 / p.frames.tf_rate), [this](const ros::WallTimerEvent&) {
          guarded([this] { publishers_->repeat_transform(); },
                  [this](const std::string& text) { complain("tf", text); });
        });
  }
  offer_live_options();
  service_spinner_.start();
}

void TrackerNodelet::complain(const char* subject, const std::string& text) {
  if (throttle_.due(subject)) NODELET_ERROR("%s", text.c_str());
}

void TrackerNodelet::offer_live_options() {
  live_options_.tracker = parameters_.tracker;
  live_options_.publish_period = parameters_.publish_period;
  live_server_ = std::make_unique<dynamic_reconfigure::Server<LiveOptions>>(live_mutex_, service_handle());
  live_server_->setCallback([this](LiveOptions& options, std::uint32_t) {
    // What is refused must not be written to the parameter server either, where it would stay.
    guarded([&] { change_options(options); },
            [&](const std::string& text) {
              options = live_options_;
              NODELET_ERROR("the options are unchanged: %s", text.c_str());
            });
  });
}

void TrackerNodelet::change_options(const LiveOptions& options) {
  const std::string changes = options.changes_since(live_options_);
  if (changes.empty()) return;
  TrackerOptions checked = live_options_.tracker;
  copy_changeable(options.tracker, &checked);
  checked.validate();
  // Before the next image; nobody waits for the one at work.
  slot_->post([this, checked] {
    guarded([&] { tracker_->set_options(checked); },
            [this](const std::string& text) { NODELET_ERROR("%s", text.c_str()); });
  });
  timer_.setPeriod(ros::WallDuration(options.publish_period));
  live_options_.tracker = checked;
  live_options_.publish_period = options.publish_period;
  NODELET_INFO("changed: %s", changes.c_str());
}

void TrackerNodelet::subscribe() {
  ros::NodeHandle& handle = getNodeHandle();
  camera_info_subscriber_ = handle.subscribe<sensor_msgs::CameraInfo>(
      camera_info_topic(handle, "image"), 5, [this](const sensor_msgs::CameraInfoConstPtr& info) {
        guarded([&] { cameras_->set_message(info); },
                [&](const std::string& text) {
                  if (throttle_.due("camera_info")) NODELET_ERROR("camera_info: %s", text.c_str());
                });
      });
  mask_subscriber_ =
      handle.subscribe<sensor_msgs::Image>("mask", 20, [this](const sensor_msgs::ImageConstPtr& mask) {
        guarded([&] { masks_.put(mask); },
                [&](const std::string& text) {
                  if (throttle_.due("mask")) NODELET_ERROR("mask: %s", text.c_str());
                });
      });
  initialpose_subscriber_ = getPrivateNodeHandle().subscribe<geometry_msgs::PoseWithCovarianceStamped>(
      "initialpose", 1,
      [this](const geometry_msgs::PoseWithCovarianceStampedConstPtr& pose) { take_initialpose(pose); });
  image_subscriber_.subscribe(
      handle, getPrivateNodeHandle(),
      {"image", parameters_.image_transport, static_cast<std::uint64_t>(parameters_.max_image_pixels)},
      [this](const sensor_msgs::ImageConstPtr& image) { take_image(image); },
      [this](const std_msgs::Header& header, Reason reason, const std::string& text) {
        refuse_image(header, reason, text);
      });
  std::string calibration = camera_info_subscriber_.getTopic();
  if (parameters_.camera_info_source == "file") {
    calibration = parameters_.camera_info_url + " alone";
  } else if (parameters_.camera_info_source == "auto" && !parameters_.camera_info_url.empty()) {
    calibration += ", or else " + parameters_.camera_info_url;
  }
  NODELET_INFO("images from %s (%s), calibration from %s", image_subscriber_.topic().c_str(),
               parameters_.image_transport.c_str(), calibration.c_str());
}

void TrackerNodelet::take_initialpose(const geometry_msgs::PoseWithCovarianceStampedConstPtr& pose) {
  const auto tell = [this](const std::string& text) { NODELET_ERROR("~initialpose: %s", text.c_str()); };
  const auto place = [this, pose, tell] {
    guarded(
        [&] {
          // An image in process when ~pause was called may have been registered since.
          if (paused_) throw std::runtime_error("paused: there is no present pose to replace");
          if (publishers_->withholds_pose()) {
            throw std::runtime_error("the camera is in another map, which is not yet merged with this one");
          }
          NODELET_WARN("~initialpose: %s", placement_->place(*pose).c_str());
        },
        tell);
  };
  guarded([&] { slot_->post(place); }, tell);
}

void TrackerNodelet::take_image(const sensor_msgs::ImageConstPtr& image) {
  const Clock::time_point arrival = Clock::now();
  const std_msgs::Header& header = image->header;
  board_->count_received();
  if (paused_) {
    board_->publish_unprocessed(header, Reason::kPaused, "paused by ~pause; call ~resume to continue",
                                arrival);
    return;
  }
  const bool clock_back = clock_went_back();
  const std::int64_t stamp_ns = static_cast<std::int64_t>(header.stamp.toNSec());
  const std::int64_t step_back_ns = time_guard_->last().value_or(stamp_ns) - stamp_ns;
  TimeGuard::Verdict verdict = time_guard_->check(stamp_ns);
  if (verdict == TimeGuard::Verdict::kStale && clock_back) {
    // A recording shorter than ~time_jump starts again.
    time_guard_->restart();
    time_guard_->check(stamp_ns);
    verdict = TimeGuard::Verdict::kJumpedBack;
  }
  const std::string step_back = format_seconds(1e-9 * static_cast<double>(step_back_ns));
  // A late image in ten is normal; a stopped clock, or images in another order than their stamps, are faults.
  constexpr double kNormalShare = 0.1, kFault = 8.5;
  excess_stale_ =
      std::max(0.0, excess_stale_ + (verdict == TimeGuard::Verdict::kStale ? 1 : 0) - kNormalShare);
  if (excess_stale_ >= kFault && input_throttle_.due("stamps")) {
    NODELET_WARN(
        "many images have a stamp that is not newer than the one before (the latest: %.3f s) and are not "
        "tracked; %s",
        header.stamp.toSec(),
        header.stamp.isZero()
            ? "the driver or the recorder leaves header.stamp empty (track_sequence --bag uses the "
              "time of recording instead)"
            : "check the clock of the driver's stamps");
  }
  if (verdict == TimeGuard::Verdict::kStale) {
    const std::string text = header.stamp.isZero()
                                 ? "the stamp is zero: the driver or the recorder leaves header.stamp empty"
                                 : "the stamp is not newer than the last one (by " + step_back + ")";
    board_->publish_unprocessed(header, Reason::kStaleStamp, text, arrival);
    return;
  }
  if (verdict == TimeGuard::Verdict::kJumpedBack) {
    ++recording_.number;
    recording_.why = "the stamps have jumped back by " + step_back;
  }
  tracker_->note_arrival(stamp_ns, arrival);
  const std::optional<Frame> displaced = slot_->put(Frame{image, arrival, ros::Time::now(), recording_});
  if (displaced) {
    board_->publish_unprocessed(displaced->image->header, Reason::kDropped,
                                "a newer image arrived while this one was waiting", displaced->arrival);
  }
}

void TrackerNodelet::refuse_image(const std_msgs::Header& header, Reason reason, const std::string& text) {
  // One at which take_image failed has been counted there.
  if (reason == Reason::kUnreadableImage) board_->count_received();
  board_->publish_unprocessed(header, paused_ ? Reason::kPaused : reason, text, Clock::now());
  if (throttle_.due(to_string(reason))) NODELET_ERROR("%s", text.c_str());
}

bool TrackerNodelet::clock_went_back() {
  if (!ros::Time::isSimTime()) return false;
  const ros::Time now = ros::Time::now();
  return now < std::exchange(last_clock_, now);
}

void TrackerNodelet::process_images() {
  while (std::optional<Frame> frame = slot_->take()) {
    guarded([&] { process(*frame); }, [this](const std::string& text) { complain("processing", text); });
  }
}

void TrackerNodelet::process(const Frame& frame) {
  const bool restarts = std::exchange(tracked_recording_, frame.recording.number) != frame.recording.number;
  if (restarts) {
    const bool kept = tracker_->restart();
    NODELET_WARN("%s: %s", frame.recording.why.c_str(),
                 kept ? "relocalising in the present map" : "the map is dropped, tracking restarts");
  }
  FrameReport report = tracker_->process(frame.image, frame.arrival);
  if (restarts && !report.map_from_camera) {
    report.reason = Reason::kTimeJump;
    report.reason_text = frame.recording.why;
  }
  const std::string placed = placement_->follow(frame.image->header, report);
  if (!placed.empty()) NODELET_WARN("%s", placed.c_str());
  if (report.map_from_camera) follow_object(report.epoch);
  report.corrections += frames_->origin_moves(report.epoch);
  publish(frame, report);
}

// A moved origin of an object is a correction: poses before and after it are treated as for a corrected map.
void TrackerNodelet::follow_object(std::uint32_t epoch) {
  if (frames_->wants_points(epoch)) {
    frames_->see_points(epoch, tracker_->map_view()->map->all().points);
  }
  const std::optional<Rigid3> moved = frames_->follow_object(epoch);
  if (moved) publishers_->move_world(*moved);
}

void TrackerNodelet::publish(const Frame& frame, const FrameReport& report) {
  if (stopping_) return;  // it was cut short: no result
  // Each output separately: an error in one must not stop the others.
  const auto tell = [this](const std::string& text) { complain("processing", text); };
  const std_msgs::Header& header = frame.image->header;
  guarded(
      [&] {
        const FrameReport in_world = frames_->in_world(report);
        if (trajectory_) trajectory_->append(in_world);
        publishers_->publish_frame(header, frame.arrival_stamp, in_world);
      },
      tell);
  guarded([&] { board_->publish(header, report, frame.arrival); }, tell);
  guarded([&] { say_state(report); }, tell);
  guarded([&] { publishers_->publish_mask(header, report.mask, tracker_->image().size()); }, tell);
  guarded(
      [&] {
        if (publishers_->debug_image_wanted() && debug_image_.is_due(report)) draw(frame, report);
      },
      tell);
}

void TrackerNodelet::draw(const Frame& frame, const FrameReport& report) {
  if (tracker_->image().empty()) return;
  publishers_->publish_debug_image(frame.image->header,
                                   debug_image_.draw(tracker_->image(), report, object_axes(report)));
}

// In the middle of the object, wherever its origin is: that may be far outside of it.
std::optional<ObjectAxes> TrackerNodelet::object_axes(const FrameReport& report) const {
  const std::optional<ObjectBox> object = frames_->object_in_world();
  if (!object || !report.map_from_camera) return std::nullopt;
  const Rigid3 camera_from_world = (frames_->world_from_map() * *report.map_from_camera).inverse();
  const Rigid3 world_from_axes(Eigen::Quaterniond::Identity(), object->centre);
  // Half of the extent: to the skin of a ball.
  return project_axes(tracker_->camera(), camera_from_world * world_from_axes, 0.5 * object->extent);
}

void TrackerNodelet::say_state(const FrameReport& report) {
  switch (report.reason) {
    case Reason::kUnsupportedEncoding:
    case Reason::kUnreadableImage:
    case Reason::kUncalibrated:
    case Reason::kImageSizeMismatch:
    case Reason::kInternalError:
      if (throttle_.due(to_string(report.reason))) NODELET_ERROR("%s", report.reason_text.c_str());
      break;
    default:
      break;
  }
  if (said_state_ == report.state && said_epoch_ == report.epoch) return;
  said_state_ = report.state;
  said_epoch_ = report.epoch;
  const std::string why = report.reason == Reason::kOk ? "" : " (" + report.reason_text + ")";
  NODELET_INFO("%s, map %u%s", to_string(report.state), report.epoch, why.c_str());
}

void TrackerNodelet::on_timer() {
  // Each check separately: an error in one must not stop the others.
  const auto tell = [this](const std::string& text) { complain("timer", text); };
  guarded([this] { publish_map(); }, tell);
  guarded([this] { check_inputs(); }, tell);
  guarded([this] { check_outputs(); }, tell);
}

void TrackerNodelet::publish_map() {
  publishers_->publish_path();
  const MapVersion version = tracker_->map_version();
  if (published_map_ && *published_map_ == version) return;
  const std::optional<MapView> view = tracker_->map_view();
  if (!view) return;
  if (parameters_.frames.object_mode) frames_->see_points(view->epoch, view->map->all().points);
  if (publishers_->publish_map(view->epoch, view->map, view->camera.parameters())) {
    published_map_ = version;
  }
}

// Health checks: missing inputs, output errors, diagnostics.

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

// Services.

namespace {

// Time for which a service waits for its turn between two images; an image takes some tens of milliseconds.
constexpr std::chrono::seconds kServiceTimeout{10};

std::string size_text(const std::vector<Map>& maps) {
  std::size_t keyframes = 0, landmarks = 0;
  for (const Map& map : maps) keyframes += map.keyframes().size(), landmarks += map.landmarks().size();
  return std::to_string(keyframes) + " keyframes and " + std::to_string(landmarks) + " landmarks" +
         (maps.size() > 1 ? " of " + std::to_string(maps.size()) + " maps" : "");
}

}  // namespace

template <typename Result>
Result TrackerNodelet::on_processing_thread(std::function<Result()> command) {
  auto task = std::make_shared<std::packaged_task<Result()>>(std::move(command));
  std::future<Result> result = task->get_future();
  const char* const shuts_down = "the tracker is shutting down";
  if (!slot_->post([task] { (*task)(); })) throw std::runtime_error(shuts_down);
  task.reset();
  if (result.wait_for(kServiceTimeout) != std::future_status::ready) {
    throw std::runtime_error("the tracker is busy and did not process the call in time: call again");
  }
  try {
    return result.get();
  } catch (const std::future_error&) {  // the slot was closed and its commands dropped
    throw std::runtime_error(shuts_down);
  }
}

std::string TrackerNodelet::path_parameter(const std::string& name, const std::string& at_start) {
  std::string path = at_start;
  const ros::NodeHandle& handle = getPrivateNodeHandle();
  if (handle.hasParam(name) && !handle.getParam(name, path)) {
    throw std::runtime_error("~" + name + " is not a text: expected a path");
  }
  if (path.empty()) throw std::runtime_error("~" + name + " is empty: expected a path");
  return expand_path(path);
}

std::string TrackerNodelet::path_to_replace(const std::string& name, const std::string& at_start) {
  std::string path = path_parameter(name, at_start);
  const std::string problem = one_file_problem(name, path, "trajectory_file", parameters_.trajectory_file);
  if (!problem.empty()) throw std::runtime_error(problem);
  return path;
}

// By a command, on the processing thread: what is known is of a map that is no more.
void TrackerNodelet::drop_map() {
  placement_->forget();
  publishers_->drop_map();
  board_->note(tracker_->state(), tracker_->epoch());
}

void TrackerNodelet::advertise_services() {
  advertise("reset", [this] {
    on_processing_thread<void>([this] {
      tracker_->reset();
      drop_map();
    });
    NODELET_WARN("reset by ~reset: the map is dropped, tracking restarts");
    return std::string("the map is dropped");
  });
  advertise("pause", [this] {
    paused_ = true;
    slot_->post([this] { placement_->forget(); });
    return std::string("paused: images are not tracked; call ~resume to continue");
  });
  advertise("resume", [this] {
    slot_->post([this] { placement_->forget(); });  // what an image gave that was at work as ~pause came
    paused_ = false;
    return std::string("tracking continues");
  });
  advertise("save_trajectory", [this] {
    const std::string path = path_to_replace("save_trajectory_path", parameters_.save_trajectory_path);
    const std::vector<KeyframePose> poses = publishers_->trajectory();
    write_tum_trajectory(path, poses);
    return std::to_string(poses.size()) + " poses in " + path;
  });
  advertise_map_services();
}

void TrackerNodelet::advertise_map_services() {
  // Files are written and read on the service's thread: images go on meanwhile.
  advertise("save_map", [this] {
    const std::string path = path_to_replace("map_path", parameters_.map_path);
    const auto saved = on_processing_thread<SavedMaps>([this] { return tracker_->copy_maps(); });
    write_map_file(path, saved);
    return size_text(saved.maps) + " in " + path;
  });
  advertise("load_map", [this] {
    const std::string path = path_parameter("map_path", parameters_.map_path);
    const auto saved = std::make_shared<SavedMaps>(read_map_file(path, descriptor_kind(parameters_.tracker)));
    const std::string size = size_text(saved->maps);
    const bool loaded = on_processing_thread<bool>([this, saved] {
      const bool is_loaded = tracker_->load_maps(std::move(*saved));
      if (is_loaded) {
        drop_map();
      } else {
        board_->note(tracker_->state(), tracker_->epoch());
      }
      return is_loaded;
    });
    const std::string what = size + " from " + path;
    const std::string then =
        loaded ? "the camera is lost until an image is relocalised in it" : "loaded when camera_info arrives";
    NODELET_WARN("%s: %s", what.c_str(), then.c_str());
    return what + "; " + then;
  });
}

void TrackerNodelet::load_map_at_start() {
  const std::string path = path_parameter("map_path", parameters_.map_path);
  SavedMaps saved = read_map_file(path, descriptor_kind(parameters_.tracker));
  NODELET_INFO("%s from %s: loaded when camera_info arrives", size_text(saved.maps).c_str(), path.c_str());
  tracker_->load_maps(std::move(saved));
}

// Not on the nodelet's queue, because a service waiting for the tracker would delay images. Not on the
// manager's thread pool either: a callback there keeps a nodelet alive while it is unloaded, but not its
// other queue.
ros::NodeHandle TrackerNodelet::service_handle() {
  ros::NodeHandle handle(getPrivateNodeHandle());
  handle.setCallbackQueue(&service_queue_);
  return handle;
}

void TrackerNodelet::advertise(const std::string& name, Answer answer) {
  using Request = std_srvs::Trigger::Request;
  using Response = std_srvs::Trigger::Response;
  services_.push_back(service_handle().advertiseService<Request, Response>(
      name,
      boost::function<bool(Request&, Response&)>([answer = std::move(answer)](Request&, Response& response) {
        response.success = false;
        guarded(
            [&] {
              response.message = answer();
              response.success = true;
            },
            [&](const std::string& text) { response.message = text; });
        return true;
      })));
}

}  // namespace mono_pose_tracker

PLUGINLIB_EXPORT_CLASS(mono_pose_tracker::TrackerNodelet, nodelet::Nodelet)
