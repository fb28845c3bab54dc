#include "ros/publishers.h"

#include <cv_bridge/cv_bridge.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "common/time_stamp.h"
#include "ros/messages.h"

namespace mono_pose_tracker {
namespace {

constexpr bool kLatched = true;

// (m/s)^2 and (rad/s)^2: variance of an unknown velocity; its square root is a hundred times the speed of any
// camera.
constexpr double kUnknownVariance = 1e6;

// Longest time between two poses for a velocity [s]. Over a longer time the camera may have stopped and
// turned round, and the mean is not its present velocity.
constexpr double kLongestStep = 1.0;

/// From blue (old) to red (new), as rviz shows where the camera was.
ColoredPoint camera_position(const KeyframePose& pose, double age) {
  ColoredPoint point;
  point.x_in_map = pose.map_from_camera.translation.cast<float>();
  point.r = static_cast<std::uint8_t>(255 * (1 - age));
  point.g = 80;
  point.b = static_cast<std::uint8_t>(255 * age);
  return point;
}

}  // namespace

Publishers::Publishers(const OutputFrames& frames, int path_max_length, ros::NodeHandle private_handle,
                       const std::function<void(const std::string&)>& tell)
    : frames_(frames),
      path_max_length_(static_cast<std::size_t>(path_max_length)),
      pose_(private_handle.advertise<geometry_msgs::PoseWithCovarianceStamped>("pose", 10)),
      odometry_(private_handle.advertise<nav_msgs::Odometry>("odometry", 10)),
      camera_frustum_(private_handle.advertise<visualization_msgs::Marker>("camera_frustum", 1, kLatched)),
      debug_image_(image_transport::ImageTransport(private_handle).advertise("debug_image", 1)),
      mask_(image_transport::ImageTransport(private_handle).advertise("mask", 1)),
      path_(
          private_handle, "path", [this] { return path(); }, tell),
      points_(
          private_handle, "points", [this] { return points(); }, tell),
      camera_positions_(
          private_handle, "camera_positions", [this] { return camera_positions(); }, tell),
      keyframes_(
          private_handle, "keyframes", [this] { return keyframes(); }, tell) {}

void Publishers::publish_frame(const std_msgs::Header& image_header, const ros::Time& arrival,
                               const FrameReport& report) {
  std::optional<OutputFrames::PublishedPose> published;
  if (report.map_from_camera) published = frames_.published_pose(image_header, report);
  remember(report, published);
  withholds_pose_ = published && keeps_odom_of_another_map(report);
  if (published && !withholds_pose_) {
    publish_pose(image_header, arrival, report, *published);
  } else {
    previous_.reset();  // where the camera went meanwhile is not known
  }
  publish_view(image_header, report);
  if (published && frames_.options().object_mode) points_.publish();
}

void Publishers::drop_map() {
  const std::lock_guard<std::mutex> lock(mutex_);
  poses_.clear();
  path_changed_ = true;
  map_to_odom_.reset();
  odom_map_ = 0;
  if (!std::exchange(camera_is_drawn_, false) || !drawn_camera_) return;
  camera_frustum_.publish(to_camera_marker(header_locked(), *drawn_camera_, nullptr, frustum_depth_));
}

void Publishers::move_world(const Rigid3& new_world_from_world) {
  previous_.reset();  // what lies between is no velocity
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<RegisteredFrame> moved;
  for (const PathEntry& entry : poses_) {
    moved.push_back({0, entry.camera.stamp_ns, new_world_from_world * entry.camera.map_from_camera});
  }
  correct(moved, std::nullopt);
  keyframes_moved_ = true;
}

void Publishers::publish_view(const std_msgs::Header& image_header, const FrameReport& report) {
  const Rigid3* pose = report.map_from_camera && !withholds_pose_ ? &*report.map_from_camera : nullptr;
  if (pose) {
    const auto transforms = frames_.view_transforms(image_header, *pose);
    if (!transforms.empty()) broadcaster_.sendTransform(transforms);
  }
  std_msgs::Header header = image_header;
  header.frame_id = frames_.world();
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!drawn_camera_ || (!pose && !camera_is_drawn_)) return;
  camera_frustum_.publish(to_camera_marker(header, *drawn_camera_, pose, frustum_depth_));
  camera_is_drawn_ = pose != nullptr;
}

void Publishers::publish_pose(const std_msgs::Header& image_header, const ros::Time& arrival,
                              const FrameReport& report, const OutputFrames::PublishedPose& published) {
  if (const auto transform = frames_.transform(image_header, published)) {
    broadcaster_.sendTransform(*transform);
    const std::lock_guard<std::mutex> lock(mutex_);
    map_to_odom_ = transform;
    odom_map_ = report.map_id;
    map_to_odom_arrival_ = arrival;
  }
  geometry_msgs::PoseWithCovarianceStamped pose;
  pose.header = image_header;
  pose.header.frame_id = published.frame;
  pose.pose = to_pose_with_covariance(published.frame_from_child);
  pose_.publish(pose);
  nav_msgs::Odometry odometry;
  odometry.header = pose.header;
  odometry.child_frame_id = published.child_frame;
  odometry.pose = pose.pose;
  // Both images refer to the same map, whose uncertainty does not affect the motion between them.
  const StampedEstimate current{report.stamp_ns,
                                {published.frame_from_child.b_from_a, published.own_covariance}};
  if (tells_velocity(report)) {
    odometry.twist = to_twist(*previous_, current);
  } else {
    // The velocity is unknown: a large covariance, for subscribers that use only covariances.
    for (int i = 0; i < 6; ++i) odometry.twist.covariance[7 * i] = kUnknownVariance;
  }
  odometry_.publish(odometry);
  previous_ = current;
  previous_epoch_ = report.epoch;
}

// A correction moves the map, not the camera: no velocity is computed across it.
bool Publishers::tells_velocity(const FrameReport& report) const {
  if (!previous_ || previous_epoch_ != report.epoch || !report.corrected.empty()) return false;
  const double seconds = seconds_between(previous_->stamp_ns, report.stamp_ns);
  return seconds > 0 && seconds <= kLongestStep;
}

// With ~odom_frame, map -> odom stays in a map that may still be joined with the present one: a robot that
// plans in map must not see the map change.
bool Publishers::keeps_odom_of_another_map(const FrameReport& report) const {
  if (frames_.options().odom_frame.empty() || report.map_id == odom_map_) return false;
  return std::find(report.inactive_maps.begin(), report.inactive_maps.end(), odom_map_) !=
         report.inactive_maps.end();
}

void Publishers::remember(const FrameReport& report,
                          const std::optional<OutputFrames::PublishedPose>& published) {
  const std::lock_guard<std::mutex> lock(mutex_);
  newest_stamp_ns_ = report.stamp_ns;
  world_from_map_ = frames_.world_from_map();
  if (report.epoch != epoch_) {  // poses of another map have another origin and scale
    epoch_ = report.epoch;
    poses_.clear();
    path_changed_ = true;
    if (report.map_id != odom_map_ && !keeps_odom_of_another_map(report)) map_to_odom_.reset();
  }
  std::optional<PathEntry> newest;
  if (report.map_from_camera && published)
    newest = PathEntry{{report.stamp_ns, *report.map_from_camera}, published};
  if (!report.corrected.empty()) correct(report.corrected, newest);
  if (!report.withdrawn_ns.empty()) withdraw(report.withdrawn_ns);
  if (!report.map_from_camera) return;
  if (!poses_.empty() && poses_.back().camera.stamp_ns == report.stamp_ns) poses_.pop_back();  // corrected
  poses_.push_back({{report.stamp_ns, *report.map_from_camera}, published});
  if (poses_.size() > path_max_length_) poses_.pop_front();
  path_changed_ = true;
}

void Publishers::withdraw(const std::vector<std::int64_t>& stamps_ns) {
  const auto is_withdrawn = [&](const PathEntry& entry) {
    return std::find(stamps_ns.begin(), stamps_ns.end(), entry.camera.stamp_ns) != stamps_ns.end();
  };
  poses_.erase(std::remove_if(poses_.begin(), poses_.end(), is_withdrawn), poses_.end());
  path_changed_ = true;
}

void Publishers::repeat_transform() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!map_to_odom_) return;
  // In the time of the images, which may differ from the clock's, extrapolated from the arrival of an image;
  // stamped ahead, so that present look-ups succeed.
  const ros::Time now = ros::Time::now();
  const bool clock_has_begun = map_to_odom_arrival_.isZero() && !now.isZero();
  if (now < map_to_odom_arrival_ || clock_has_begun) return;  // the clock has jumped
  const std::int64_t ahead_ns = std::llround(1e9 * frames_.options().tf_tolerance);
  const std::optional<ros::Time> stamp =
      later(map_to_odom_->header.stamp,
            static_cast<std::int64_t>(now.toNSec() - map_to_odom_arrival_.toNSec()) + ahead_ns);
  if (!stamp || *stamp == repeated_stamp_) return;  // the end of time, or the clock stands still
  geometry_msgs::TransformStamped transform = *map_to_odom_;
  transform.header.stamp = *stamp;
  repeated_stamp_ = transform.header.stamp;
  broadcaster_.sendTransform(transform);
}

// Moves the cameras of the path. A frame keeps the pose of its tracked frame relative to its camera; if none
// is known, that of the newest frame is used.
void Publishers::correct(const std::vector<RegisteredFrame>& frames, const std::optional<PathEntry>& newest) {
  std::map<std::int64_t, PathEntry> known;
  for (PathEntry& entry : poses_) known.emplace(entry.camera.stamp_ns, std::move(entry));
  poses_.clear();
  for (const RegisteredFrame& frame : frames) {
    const auto before = known.find(frame.stamp_ns);
    const bool was_known = before != known.end() && before->second.published;
    PathEntry entry{{frame.stamp_ns, frame.map_from_camera}, std::nullopt};
    if (was_known || newest) {
      const PathEntry& like = was_known ? before->second : *newest;
      entry.published = like.published;
      Rigid3& pose = entry.published->frame_from_child.b_from_a;
      const Rigid3& world_from_camera = like.camera.map_from_camera;
      pose = entry.published->frame == frames_.world()
                 ? frame.map_from_camera * (world_from_camera.inverse() * pose)
                 : (pose * world_from_camera) * frame.map_from_camera.inverse();
    }
    poses_.push_back(std::move(entry));
    if (poses_.size() > path_max_length_) poses_.pop_front();
  }
  path_changed_ = true;
}

std::vector<KeyframePose> Publishers::trajectory() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<KeyframePose> poses;
  poses.reserve(poses_.size());
  for (const PathEntry& entry : poses_) poses.push_back(entry.camera);
  return poses;
}

// The frame of an object's map turns with it: use the last stamp with tf.
std_msgs::Header Publishers::header_locked() const {
  std_msgs::Header header;
  header.frame_id = frames_.world();
  const bool turns = frames_.options().object_mode && !poses_.empty();
  header.stamp = to_ros_time(turns ? poses_.back().camera.stamp_ns : newest_stamp_ns_);
  return header;
}

void Publishers::publish_mask(const std_msgs::Header& header, const cv::Mat& mask,
                              const cv::Size& image_size) const {
  if (mask_.getNumSubscribers() == 0 || image_size.empty()) return;
  const cv::Mat all = mask.empty() ? cv::Mat(image_size, CV_8UC1, cv::Scalar(255)) : mask;
  mask_.publish(cv_bridge::CvImage(header, "mono8", all).toImageMsg());
}

void Publishers::publish_debug_image(const std_msgs::Header& header, const cv::Mat& bgr) const {
  debug_image_.publish(cv_bridge::CvImage(header, "bgr8", bgr).toImageMsg());
}

bool Publishers::publish_map(std::uint32_t epoch, const std::shared_ptr<const DrawnMap>& map,
                             const CameraParameters& camera) {
  const double depth = frustum_depth(map->newest(), camera);  // wherever in the world the map is
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    map_ = map;
    map_epoch_ = epoch;
    drawn_camera_ = camera;
    frustum_depth_ = depth;
    if (!is_placed_locked()) return false;
  }
  points_.publish();
  keyframes_.publish();
  return true;
}

// Where an object is, tf says from its first pose on.
bool Publishers::is_placed_locked() const {
  if (!map_) return false;
  if (!frames_.options().object_mode || !map_->has_points()) return true;
  return map_epoch_ == epoch_ && !poses_.empty();
}

std::optional<Publishers::PlacedMap> Publishers::placed_map() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!is_placed_locked() || !drawn_camera_) return std::nullopt;
  return PlacedMap{header_locked(), world_from_map_, map_, *drawn_camera_, frustum_depth_};
}

std::optional<sensor_msgs::PointCloud2> Publishers::points() const {
  const std::optional<PlacedMap> at = placed_map();
  if (!at) return std::nullopt;
  MapSnapshot points;
  points.points = at->map->all().points;
  return to_point_cloud(at->header, in_world(at->world_from_map, points).points);
}

std::optional<visualization_msgs::MarkerArray> Publishers::keyframes() const {
  const std::optional<PlacedMap> at = placed_map();
  if (!at) return std::nullopt;
  MapSnapshot keyframes;
  keyframes.keyframes = at->map->all().keyframes;
  keyframes = in_world(at->world_from_map, keyframes);
  return to_keyframe_markers(at->header, at->camera,
                             thinned_keyframes(keyframes.keyframes, at->frustum_depth), at->frustum_depth);
}

void Publishers::publish_path() {
  bool keyframes_moved, path_changed;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    keyframes_moved = std::exchange(keyframes_moved_, false);
    path_changed = std::exchange(path_changed_, false);
    has_path_ |= path_changed;
  }
  if (keyframes_moved) keyframes_.publish();
  if (!path_changed) return;
  path_.publish();
  camera_positions_.publish();
}

std::optional<nav_msgs::Path> Publishers::path() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!has_path_) return std::nullopt;
  nav_msgs::Path path;
  path.header = header_locked();
  for (const PathEntry& entry : poses_) {
    if (!entry.published) continue;
    geometry_msgs::PoseStamped pose;
    pose.header.frame_id = path.header.frame_id = entry.published->frame;
    pose.header.stamp = to_ros_time(entry.camera.stamp_ns);
    pose.pose = to_pose(entry.published->frame_from_child.b_from_a);
    path.poses.push_back(std::move(pose));
  }
  return path;
}

std::optional<sensor_msgs::PointCloud2> Publishers::camera_positions() const {
  std_msgs::Header header;
  std::vector<ColoredPoint> positions;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!has_path_) return std::nullopt;
    header = header_locked();
    positions.reserve(poses_.size());
    for (const PathEntry& entry : poses_) {
      const double age = 1 - static_cast<double>(positions.size() + 1) / static_cast<double>(poses_.size());
      positions.push_back(camera_position(entry.camera, age));
    }
  }
  return to_point_cloud(header, positions);
}

}  // namespace mono_pose_tracker
