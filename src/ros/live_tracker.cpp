#include "ros/live_tracker.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "camera/camera_parameters.h"
#include "mono_pose_tracker/tracking/options_table.h"
#include "ros/image_conversion.h"

namespace mono_pose_tracker {

void MaskSource::put(const sensor_msgs::ImageConstPtr& mask) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    masks_.push_back(mask);
    if (masks_.size() > kCapacity) masks_.pop_front();
  }
  arrived_.notify_all();
}

sensor_msgs::ImageConstPtr MaskSource::wait(const ros::Time& stamp, std::chrono::milliseconds timeout) {
  sensor_msgs::ImageConstPtr found;
  std::unique_lock<std::mutex> lock(mutex_);
  arrived_.wait_for(lock, timeout, [&] {
    const auto it = std::find_if(masks_.begin(), masks_.end(), [&](const sensor_msgs::ImageConstPtr& mask) {
      return mask->header.stamp == stamp;
    });
    if (it != masks_.end()) found = *it;
    return cancelled_ || found != nullptr;
  });
  return found;
}

void MaskSource::cancel() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    cancelled_ = true;
  }
  arrived_.notify_all();
}

namespace {

// The first image waits this long for its camera_info, which drivers and bags send just after it.
constexpr std::chrono::milliseconds kCameraInfoTimeout{200};

double seconds_of(LiveTracker::Clock::time_point time) {
  return std::chrono::duration<double>(time.time_since_epoch()).count();
}

std::string size_text(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

}  // namespace

LiveTracker::LiveTracker(const TrackerOptions& options, CameraSource& cameras, MaskSource& masks,
                         std::chrono::milliseconds mask_timeout, std::function<bool()> mask_wanted, Warn warn,
                         const GreyLevelChoice& levels)
    : options_(options),
      cameras_(cameras),
      masks_(masks),
      mask_timeout_(mask_timeout),
      mask_wanted_(std::move(mask_wanted)),
      warn_(std::move(warn)),
      levels_(levels) {}

FrameReport LiveTracker::process(const sensor_msgs::ImageConstPtr& message, Clock::time_point arrival) {
  FrameReport report;
  try {
    report = track(message);
    govern(arrival);
  } catch (const std::exception& e) {
    report = refuse(Reason::kInternalError, e.what());
  } catch (...) {
    report = refuse(Reason::kInternalError, "unknown exception");
  }
  report.stamp_ns = static_cast<std::int64_t>(message->header.stamp.toNSec());
  state_ = report.state;
  epoch_ = report.epoch;
  return report;
}

void LiveTracker::note_arrival(std::int64_t stamp_ns, Clock::time_point arrival) {
  period_.note(1e-9 * static_cast<double>(stamp_ns), seconds_of(arrival));
}

void LiveTracker::govern(Clock::time_point arrival) {
  if (!tracker_) return;
  const std::chrono::duration<double, std::milli> latency = Clock::now() - arrival;
  const bool overtaken = period_.has_come_after(seconds_of(arrival));
  tracker_->set_load_level(governor_.observe(period_.milliseconds(), latency.count(), overtaken));
}

FrameReport LiveTracker::track(const sensor_msgs::ImageConstPtr& message) {
  if (!levels_.is_settled() && levels_.look_at(convert_with_all_bits(message).image))
    warn_("", levels_.text());
  image_ = convert_image(message, levels_.levels());
  const cv::Mat& image = image_.image;
  if (image_.reason != Reason::kOk) return refuse(image_.reason, image_.error);

  if (!image.empty()) cameras_.set_image_size(image.cols, image.rows);
  const std::optional<ConvertedCamera> camera =
      cameras_.wait(std::exchange(first_image_, false) ? kCameraInfoTimeout : std::chrono::milliseconds(0));
  if (!camera) return refuse(Reason::kNoCameraInfo, "no camera_info has arrived");
  if (camera->reason != Reason::kOk) return refuse(camera->reason, camera->error);
  const CameraParameters& parameters = camera->parameters;
  if (image.cols != parameters.width || image.rows != parameters.height) {
    return refuse(Reason::kImageSizeMismatch,
                  "the image " + size_mismatch_text(image.cols, image.rows, parameters.width,
                                                    parameters.height, camera->size_origin));
  }
  std::string change;
  if (!tracker_ || !is_present_camera(parameters)) {
    if (tracker_) change = difference(camera_.parameters(), parameters);
    if (camera->source == CalibrationSource::kGuessed) {
      warn_("",
            "no calibration: the camera is guessed from ~hfov; the shape of the map is only as accurate as "
            "this "
            "guess");
    } else if (cameras_.may_guess()) {
      warn_("guess", "a calibration is used: ~hfov is ignored");
    }
    use_camera(parameters);
    load_waiting_maps();
  }

  FrameReport report =
      tracker_->process(static_cast<std::int64_t>(message->header.stamp.toNSec()), image, mask_for(*message));
  has_tracked_ = has_tracked_ || report.map_from_camera;
  // Not "move sideways": that is no help where the next image has another calibration again.
  if (!change.empty() && !report.map_from_camera) {
    report.reason = Reason::kCalibrationChanged;
    report.reason_text = "the calibration has changed (" + change +
                         "): tracking restarts. If the camera has not changed, give a calibration file with "
                         "~camera_info_url, and set ~camera_info_source to file";
  }
  report.epoch += epoch_base_;
  calibration_ = report.calibration = camera->source;
  if (report.map_id > 0) report.map_id += epoch_base_;
  for (std::uint32_t& id : report.inactive_maps) id += epoch_base_;
  remember(report);
  return report;
}

void LiveTracker::remember(const FrameReport& report) {
  of_map_.map_id = report.map_id;
  of_map_.corrections = report.corrections;
  of_map_.inactive_maps = report.inactive_maps;
  of_map_.scale = report.scale;
  of_map_.keyframes = report.keyframes;
  of_map_.landmarks = report.landmarks;
  of_map_.load_level = report.load_level;
}

// Report of a refused image. The map does not change: an unusable image must not look like another map to
// subscribers.
FrameReport LiveTracker::refuse(Reason reason, const std::string& text) const {
  FrameReport report = of_map_;
  report.state = state_;
  report.reason = reason;
  report.reason_text = text;
  report.epoch = epoch_;
  report.calibration = calibration_;
  return report;
}

// Small differences of the calibration are tolerated, because dropping the map costs more.
bool LiveTracker::is_present_camera(const CameraParameters& parameters) const {
  return is_same_camera(camera_.parameters(), parameters, kToleratedCalibrationChangePx);
}

void LiveTracker::use_camera(const CameraParameters& parameters) {
  const CameraModel camera(parameters);
  std::shared_ptr<Tracker> tracker = std::make_shared<Tracker>(options_, camera, Tracker::Mapping::kThreaded);
  if (tracker_) {
    // Nor is a map gone that was loaded with a calibration in which no image was found in it.
    if (options_.localize_only || !has_tracked_) waiting_maps_ = tracker_->copy_maps();
    warn_("changed calibration", waiting_maps_ ? "the calibration has changed: relocalising in the same map"
                                               : "the calibration has changed: the map is dropped");
    ++epoch_;
    of_map_ = FrameReport();
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  epoch_base_ = epoch_;
  tracker_.swap(tracker);  // the old one joins its worker: after the lock is gone
  camera_ = camera;
  has_tracked_ = false;
  tracker_->set_load_level(governor_.level());
  if (cancelled_) tracker_->cancel();
  ++trackers_;
}

SavedMaps LiveTracker::copy_maps() {
  std::optional<SavedMaps> saved;
  if (tracker_) saved = tracker_->copy_maps();
  if (!saved) throw std::runtime_error("there is no map yet");
  return std::move(*saved);
}

bool LiveTracker::load_maps(SavedMaps saved) {
  const std::optional<ConvertedCamera> camera = cameras_.wait(std::chrono::milliseconds(0));
  if (camera && camera->reason == Reason::kOk && (!tracker_ || !is_present_camera(camera->parameters))) {
    use_camera(camera->parameters);
  }
  waiting_maps_ = std::move(saved);
  if (!tracker_) return false;
  load_waiting_maps();
  return true;
}

void LiveTracker::load_waiting_maps() {
  if (!waiting_maps_) return;
  SavedMaps saved = *std::exchange(waiting_maps_, std::nullopt);
  tracker_->load_maps(std::move(saved));
  has_tracked_ = false;
  go_on_as(State::kLost);
}

// By a command: nothing is known about the map until an image has been registered in it.
void LiveTracker::go_on_as(State state) {
  epoch_ = epoch_base_ + tracker_->epoch();
  of_map_ = FrameReport();
  state_ = state;
}

cv::Mat LiveTracker::mask_for(const sensor_msgs::Image& message) {
  const cv::Mat mask = mask_of_topic(message);
  if (image_.mask.empty()) return mask;
  if (!std::exchange(has_alpha_, true))
    warn_("", "the images have an alpha channel: transparent pixels (alpha 0) are masked");
  return mask.empty() ? image_.mask : cv::Mat(mask & image_.mask);
}

cv::Mat LiveTracker::mask_of_topic(const sensor_msgs::Image& message) {
  if (!mask_wanted_()) return {};
  const sensor_msgs::ImageConstPtr mask = masks_.wait(message.header.stamp, mask_timeout_);
  if (!mask) {
    warn_("missing mask", "no mask has the image's stamp: the image is used unmasked");
    return {};
  }
  ConvertedImage converted = convert_mask(mask);
  if (converted.reason == Reason::kOk && converted.image.size() != image_.image.size()) {
    converted.error = "its size is " + size_text(converted.image.cols, converted.image.rows);
  }
  if (!converted.error.empty()) {
    warn_("unusable mask", "the mask can't be used (" + converted.error + "): the image is used unmasked");
    return {};
  }
  return converted.image;
}

void LiveTracker::set_options(const TrackerOptions& options) {
  TrackerOptions changed = options_;
  copy_changeable(options, &changed);
  changed.validate();  // before anything has changed
  if (tracker_) tracker_->set_options(changed);
  options_ = changed;
}

void LiveTracker::transform_map(const Sim3& new_from_map, std::optional<ScaleSource> scale_source) {
  if (tracker_) tracker_->transform_map(new_from_map, scale_source);
}

void LiveTracker::reset() {
  waiting_maps_.reset();
  if (!tracker_) return;
  tracker_->reset();
  go_on_as(State::kBootstrapping);
}

bool LiveTracker::restart() {
  if (!tracker_) return true;
  if (!options_.localize_only || tracker_->revision() == 0) {
    reset();
    return false;
  }
  tracker_->restart();
  go_on_as(State::kLost);
  return true;
}

std::vector<RegisteredFrame> LiveTracker::trajectory() const {
  return tracker_ ? tracker_->trajectory() : std::vector<RegisteredFrame>();
}

void LiveTracker::wait_for_mapping() {
  if (tracker_) tracker_->wait();
}

void LiveTracker::cancel() {
  masks_.cancel();
  const std::lock_guard<std::mutex> lock(mutex_);
  cancelled_ = true;
  if (tracker_) tracker_->cancel();
}

MapVersion LiveTracker::map_version() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return {trackers_, tracker_ ? tracker_->revision() : 0};
}

std::optional<MapView> LiveTracker::map_view() const {
  std::shared_ptr<Tracker> tracker;
  MapView view;
  std::uint32_t epoch_base = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!tracker_) return std::nullopt;
    tracker = tracker_;
    view.camera = camera_;
    epoch_base = epoch_base_;
  }
  view.map = std::make_shared<DrawnMap>(tracker->view());
  view.epoch = epoch_base + view.map->newest().epoch;
  return view;
}

}  // namespace mono_pose_tracker
