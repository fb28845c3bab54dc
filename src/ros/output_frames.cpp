#include "ros/output_frames.h"

#include <ros/time.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>
#include <vector>

#include "ros/messages.h"

namespace mono_pose_tracker {
namespace {

// On either side, of the points: more than that are rarely wrong.
constexpr double kExcludedShare = 0.05;

}  // namespace

std::optional<ObjectBox> box_of(const std::vector<ColoredPoint>& points) {
  if (points.empty()) return std::nullopt;
  ObjectBox box;
  std::vector<float> values(points.size());
  const auto excluded = static_cast<std::ptrdiff_t>(kExcludedShare * static_cast<double>(points.size()));
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(points.begin(), points.end(), values.begin(),
                   [axis](const ColoredPoint& point) { return point.x_in_map[axis]; });
    const auto at = [&values](std::ptrdiff_t rank) -> double {
      std::nth_element(values.begin(), values.begin() + rank, values.end());
      return values[static_cast<std::size_t>(rank)];
    };
    const double low = at(excluded), high = at(static_cast<std::ptrdiff_t>(values.size()) - 1 - excluded);
    box.centre[axis] = 0.5 * (low + high);
    box.extent = std::max(box.extent, high - low);
  }
  return box;
}

void ObjectCentre::see(std::uint32_t epoch, const std::vector<ColoredPoint>& points) {
  if (seen_epoch_ && epoch < *seen_epoch_) return;  // somebody has seen the next map meanwhile
  const std::optional<ObjectBox> box = box_of(points);
  if (!box) return;
  seen_epoch_ = epoch;
  seen_ = *box;
}

bool ObjectCentre::wants_points(std::uint32_t epoch) const { return epoch_ != epoch && seen_epoch_ != epoch; }

std::optional<Eigen::Vector3d> ObjectCentre::follow(std::uint32_t epoch) {
  if (seen_epoch_ != epoch) return std::nullopt;
  const bool is_new = epoch_ != epoch;
  const Eigen::Vector3d off = seen_.centre - box_.centre;
  if (!is_new && off.norm() <= kMostOff * seen_.extent) return std::nullopt;
  epoch_ = epoch;
  box_ = seen_;
  moves_ = is_new ? 0 : moves_ + 1;
  if (is_new) return std::nullopt;
  return off;
}

namespace {

/// REP-103: x forward, y left, z up, of a camera's optical axes (x right, y down, z forward).
Eigen::Matrix3d z_up_from_optical() {
  Eigen::Matrix3d R;
  R << 0, 0, 1,  //
      -1, 0, 0,  //
      0, -1, 0;
  return R;
}

Rigid3 to_rigid(const geometry_msgs::Transform& transform) {
  const auto& q = transform.rotation;
  const auto& t = transform.translation;
  return {Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized(), Eigen::Vector3d(t.x, t.y, t.z)};
}

}  // namespace

OutputFrames::OutputFrames(const FrameOptions& options, Warn warn)
    : options_(options), warn_(std::move(warn)) {
  if (!options_.publish_tf && options_.base_frame.empty() && options_.odom_frame.empty()) return;
  tf_listening_ = buffer_._addTransformsChangedListener([this] {
    const std::lock_guard<std::mutex> lock(tf_mutex_);
    ++tf_changes_;
    tf_changed_.notify_all();
  });
  listener_ = std::make_unique<tf2_ros::TransformListener>(buffer_);
}

OutputFrames::~OutputFrames() {
  listener_.reset();  // its thread calls what is destroyed before it
  tf_listening_.disconnect();
}

void OutputFrames::cancel() {
  {
    const std::lock_guard<std::mutex> lock(tf_mutex_);
    cancelled_ = true;
  }
  tf_changed_.notify_all();
}

bool OutputFrames::wants_points(std::uint32_t epoch) const {
  if (!options_.object_mode) return false;
  const std::lock_guard<std::mutex> lock(mutex_);
  return centre_.wants_points(epoch);
}

void OutputFrames::see_points(std::uint32_t epoch, const std::vector<ColoredPoint>& points) {
  if (!options_.object_mode) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  centre_.see(epoch, points);
}

std::optional<Rigid3> OutputFrames::follow_object(std::uint32_t epoch) {
  if (!options_.object_mode) return std::nullopt;
  const Rigid3 before = world_from_map();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!centre_.follow(epoch)) return std::nullopt;
  }
  if (!is_centred()) return std::nullopt;
  return world_from_map() * before.inverse();
}

std::uint32_t OutputFrames::origin_moves(std::uint32_t epoch) const {
  if (!is_centred()) return 0;
  const std::lock_guard<std::mutex> lock(mutex_);
  return centre_.moves(epoch);
}

Rigid3 OutputFrames::world_from_map() const {
  Rigid3 world_from_map;
  if (options_.map_orientation == "z_up")
    world_from_map = Rigid3(z_up_from_optical(), Eigen::Vector3d::Zero());
  if (!is_centred()) return world_from_map;
  const std::lock_guard<std::mutex> lock(mutex_);
  world_from_map.translation = -(world_from_map.rotation * centre_.in_map());
  return world_from_map;
}

std::optional<ObjectBox> OutputFrames::object_in_world() const {
  if (!options_.object_mode) return std::nullopt;
  const Rigid3 world_from_map = this->world_from_map();
  const std::lock_guard<std::mutex> lock(mutex_);
  return ObjectBox{world_from_map * centre_.in_map(), centre_.extent()};
}

FrameReport OutputFrames::in_world(FrameReport report) const {
  const Rigid3 world_from_map = this->world_from_map();
  for (RegisteredFrame& frame : report.corrected)
    frame.map_from_camera = world_from_map * frame.map_from_camera;
  if (!report.map_from_camera) return report;
  const PoseEstimate pose = world_from_map * PoseEstimate{*report.map_from_camera, report.covariance};
  report.map_from_camera = pose.b_from_a;
  report.covariance = pose.covariance;
  report.map_covariance = (world_from_map * PoseEstimate{Rigid3(), report.map_covariance}).covariance;
  return report;
}

/// tf takes neither an empty name nor the leading slashes of older drivers.
std::string OutputFrames::camera_frame(const std_msgs::Header& image_header) const {
  if (!options_.camera_frame.empty()) return options_.camera_frame;
  const std::string frame = without_leading_slashes(image_header.frame_id);
  return frame.empty() ? "camera" : frame;
}

/// Waits by the wall clock: ROS time may stop (paused bag), and tf2's own waiting with it.
std::chrono::steady_clock::time_point OutputFrames::deadline_of(const ros::Time& stamp) const {
  const std::lock_guard<std::mutex> lock(tf_mutex_);
  if (stamp != waited_stamp_ || deadline_ == std::chrono::steady_clock::time_point()) {
    const auto timeout = std::chrono::duration<double>(options_.tf_timeout);
    waited_stamp_ = stamp;
    deadline_ = std::chrono::steady_clock::now() +
                std::chrono::duration_cast<std::chrono::steady_clock::duration>(timeout);
  }
  return deadline_;
}

/// Odometry often arrives a little later than the image with its stamp.
bool OutputFrames::wait_for_transform(const std::string& parent, const std::string& child,
                                      const ros::Time& stamp, std::string* why) const {
  const std::chrono::steady_clock::time_point deadline = deadline_of(stamp);
  while (true) {
    std::uint64_t changes;
    {
      const std::lock_guard<std::mutex> lock(tf_mutex_);
      changes = tf_changes_;
    }
    if (buffer_.canTransform(parent, child, stamp, why)) return true;
    std::unique_lock<std::mutex> lock(tf_mutex_);
    tf_changed_.wait_until(lock, deadline, [&] { return cancelled_ || tf_changes_ != changes; });
    if (cancelled_ || tf_changes_ == changes) return false;
  }
}

std::optional<Rigid3> OutputFrames::look_up(const std::string& parent, const std::string& child,
                                            const ros::Time& stamp) const {
  std::string why;
  if (!wait_for_transform(parent, child, stamp, &why)) {
    warn_("no tf to " + child, "tf has no transform from " + parent + " to " + child + ": " + why);
    return std::nullopt;
  }
  try {
    return to_rigid(buffer_.lookupTransform(parent, child, stamp).transform);
  } catch (const tf2::TransformException& e) {  // gone since: the clock has jumped
    warn_("no tf to " + child, e.what());
    return std::nullopt;
  }
}

/// Whether the map's own units would be mixed with metres: the transforms from base to camera and from odom
/// to base are in metres.
bool OutputFrames::mixes_units(const std::string& camera, ScaleSource scale) const {
  if (scale != ScaleSource::kMapUnits) return false;
  return !options_.odom_frame.empty() || (!options_.base_frame.empty() && options_.base_frame != camera);
}

void OutputFrames::tell_ways_to_metres() const {
  if (options_.scale_from_odometry) {
    warn_("map units",
          "neither pose nor tf is published yet: the map's unit is unknown until scale/odometry has measured "
          "it over about the first 1.5 m of the path in " +
              options_.odom_frame);
    return;
  }
  warn_("map units", std::string("neither pose nor tf is published: ") +
                         (options_.base_frame.empty() ? "~odom_frame" : "~base_frame") +
                         " is in metres, but the scale of the map is unknown. Set the scale by "
                         "scale/known_baseline, scale/initial_median_depth, scale/marker_size (a marker in "
                         "view at the start of the map, or later), scale/odometry (of a robot with "
                         "~odom_frame) or a map saved in metres; or leave ~base_frame and ~odom_frame empty");
}

std::optional<OutputFrames::PublishedPose> OutputFrames::published_pose(const std_msgs::Header& image_header,
                                                                        const FrameReport& report) const {
  const std::string camera = camera_frame(image_header);
  if (mixes_units(camera, report.scale)) {
    tell_ways_to_metres();
    return std::nullopt;
  }
  std::string tracked_frame = camera;
  PoseEstimate world_from_tracked{*report.map_from_camera, report.covariance};
  PoseEstimate own{*report.map_from_camera, report.covariance - report.map_covariance};
  if (!options_.base_frame.empty() && options_.base_frame != camera) {
    // At the image's time: the camera may be on a neck that turns.
    const std::optional<Rigid3> camera_from_base = look_up(camera, options_.base_frame, image_header.stamp);
    if (!camera_from_base) return std::nullopt;
    world_from_tracked = world_from_tracked * *camera_from_base;
    own = own * *camera_from_base;
    tracked_frame = options_.base_frame;
  }
  if (options_.object_mode) {
    return PublishedPose{tracked_frame, world(), inverse(world_from_tracked), inverse(own).covariance};
  }
  return PublishedPose{world(), tracked_frame, world_from_tracked, own.covariance};
}

Rigid3 OutputFrames::map_from_camera(const std_msgs::Header& image_header, ScaleSource scale,
                                     const Rigid3& world_from_tracked) const {
  if (options_.object_mode)
    throw std::runtime_error("the map is of an object (~object_mode): it has no world frame to be placed in");
  const std::string camera = camera_frame(image_header);
  if (mixes_units(camera, scale)) {
    throw std::runtime_error("the scale of the map is not yet known: it can't be placed in metres");
  }
  Rigid3 world_from_camera = world_from_tracked;
  if (!options_.base_frame.empty() && options_.base_frame != camera) {
    const std::optional<Rigid3> base_from_camera = look_up(options_.base_frame, camera, image_header.stamp);
    if (!base_from_camera) throw std::runtime_error("tf has no transform from the base to its camera");
    world_from_camera = world_from_tracked * *base_from_camera;
  }
  return world_from_map().inverse() * world_from_camera;
}

std::optional<Rigid3> OutputFrames::odom_from_camera(const std_msgs::Header& image_header) const {
  return look_up(options_.odom_frame, camera_frame(image_header), image_header.stamp);
}

std::optional<geometry_msgs::TransformStamped> OutputFrames::transform(const std_msgs::Header& image_header,
                                                                       const PublishedPose& pose) const {
  if (!options_.publish_tf) return std::nullopt;
  std::string parent = pose.frame, child = pose.child_frame;
  Rigid3 parent_from_child = pose.frame_from_child.b_from_a;
  if (!options_.odom_frame.empty()) {
    const std::optional<Rigid3> tracked_from_odom = look_up(child, options_.odom_frame, image_header.stamp);
    if (!tracked_from_odom) return std::nullopt;
    parent_from_child = parent_from_child * *tracked_from_odom;
    child = options_.odom_frame;
  }
  if (options_.invert_tf) {
    parent_from_child = parent_from_child.inverse();
    parent.swap(child);
  }
  const std::string problem = conflict(parent, child);
  if (!problem.empty()) {
    warn_("tf refused to " + child, problem);
    return std::nullopt;
  }
  std_msgs::Header header = image_header;
  header.frame_id = parent;
  return to_transform(header, child, parent_from_child);
}

std::vector<geometry_msgs::TransformStamped> OutputFrames::view_transforms(
    const std_msgs::Header& image_header, const Rigid3& world_from_camera) const {
  if (!options_.publish_tf || options_.view_frame.empty()) return {};
  const std::string problem = view_problem(camera_frame(image_header));
  if (!problem.empty()) {
    warn_("view frame", "no tf is published from " + world() + " to " + options_.view_frame + ": " + problem +
                            " (or none)");
    return {};
  }
  std_msgs::Header header = image_header;
  header.frame_id = world();
  std::vector<geometry_msgs::TransformStamped> transforms{
      to_transform(header, options_.view_frame, world_from_camera)};
  if (const std::optional<ObjectBox> object = object_in_world()) {
    const Rigid3 world_from_middle(Eigen::Quaterniond::Identity(), object->centre);
    transforms.push_back(to_transform(header, options_.view_frame + kMiddleSuffix, world_from_middle));
  }
  return transforms;
}

std::string OutputFrames::view_problem(const std::string& camera) const {
  // It would be there twice, or have the world below it that the camera is below, or above.
  if (options_.view_frame == camera ||
      (options_.object_mode && options_.view_frame + kMiddleSuffix == camera)) {
    return camera + " is the images' own frame; expected another ~view_frame";
  }
  std::string other;
  if (buffer_._getParent(options_.view_frame, ros::Time(0), other) && other != world()) {
    return "its parent is " + other + " already; another tracker needs another ~view_frame";
  }
  return "";
}

std::string OutputFrames::conflict(const std::string& parent, const std::string& child) const {
  const std::string refused = "no tf is published from " + parent + " to " + child + ": ";
  if (parent == child) return refused + "they are the same frame";
  std::string other;
  if (buffer_._getParent(child, ros::Time(0), other) && other != parent) {
    return refused + child + " has the parent " + other +
           " already, and a frame can have only one parent (REP-105); set ~base_frame or ~odom_frame to the "
           "root of its tree, or ~invert_tf, or ~publish_tf to false";
  }
  // 100: deeper than any robot is; tf itself may hold a loop made by others.
  std::string above = parent;
  for (int i = 0; i < 100 && buffer_._getParent(above, ros::Time(0), other); ++i) {
    if (other == child)
      return refused + parent + " is below " + child + " already: the tree would have a loop";
    above = other;
  }
  return "";
}

MapSnapshot in_world(const Rigid3& world_from_map, const MapSnapshot& snapshot) {
  MapSnapshot result = snapshot;
  for (ColoredPoint& point : result.points) {
    point.x_in_map = (world_from_map * point.x_in_map.cast<double>()).cast<float>();
  }
  for (KeyframePose& keyframe : result.keyframes) {
    keyframe.map_from_camera = world_from_map * keyframe.map_from_camera;
  }
  return result;
}

}  // namespace mono_pose_tracker
