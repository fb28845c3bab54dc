#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <std_msgs/Header.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <boost/signals2/connection.hpp>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "mono_pose_tracker/tracking/frame_report.h"
#include "ros/frame_options.h"
#include "ros/object_centre.h"
#include "ros/pose_estimate.h"

namespace mono_pose_tracker {

/// Turns the tracker's results, which are in the optical axes of the first camera, into the frames that the
/// user wants. Two frames matter: the world (map, or the object), in which points and cameras are given; and
/// the body (the camera, or the robot's base), whose pose is published.
///
/// May be called from any thread.
class OutputFrames {
 public:
  /// subject: what the text is about, which may be said again and again (LogThrottle).
  using Warn = std::function<void(const std::string& subject, const std::string& text)>;

  /// options: normalised. warn: what a user should hear.
  OutputFrames(const FrameOptions& options, Warn warn);
  ~OutputFrames();

  /// Whoever waits for tf is woken, and nobody waits any more.
  void cancel();

  const FrameOptions& options() const { return options_; }

  const std::string& world() const {
    return options_.object_mode ? options_.object_frame : options_.map_frame;
  }

  /// Whether an object's centre in this map hangs on its points and none were seen.
  bool wants_points(std::uint32_t epoch) const;
  /// Those of the map's newest revision, of an object.
  void see_points(std::uint32_t epoch, const std::vector<ColoredPoint>& points);
  /// Called before a posed frame is given: the only time at which an object's origin moves within a map.
  /// Returns new_world_from_world when it has.
  std::optional<Rigid3> follow_object(std::uint32_t epoch);
  /// How often the origin has moved in this map.
  std::uint32_t origin_moves(std::uint32_t epoch) const;

  /// Where the tracker's map is in the world.
  Rigid3 world_from_map() const;
  /// The middle of the object, in the world, and how long it is. Nothing without one.
  std::optional<ObjectBox> object_in_world() const;
  /// The same with poses and covariance in the world's frame.
  FrameReport in_world(FrameReport report) const;

  /// The body in the world; of an object, the object in the body's frame.
  struct PublishedPose {
    std::string frame, child_frame;
    PoseEstimate frame_from_child;
    /// With the map held: of what moves from one image to the next.
    Eigen::Matrix<double, 6, 6> own_covariance = Eigen::Matrix<double, 6, 6>::Zero();
  };
  /// Of a report in the world's frame. Nothing when tf does not know where the base has its camera, or when
  /// the map's units, which are no metres, would be mixed with a robot's metres.
  std::optional<PublishedPose> published_pose(const std_msgs::Header& image_header,
                                              const FrameReport& report) const;

  /// Where the camera would be in the map (not the world) if the body were there. Throws std::runtime_error
  /// where nobody can say, the map is an object, or its units would be mixed with a robot's metres.
  Rigid3 map_from_camera(const std_msgs::Header& image_header, ScaleSource scale,
                         const Rigid3& world_from_tracked) const;
  /// The camera as odometry has it, its place on the robot included; nothing when tf does not know.
  std::optional<Rigid3> odom_from_camera(const std_msgs::Header& image_header) const;

  /// What tf shall get; nothing when it is not to have any, or must not: a frame would get a second parent.
  std::optional<geometry_msgs::TransformStamped> transform(const std_msgs::Header& image_header,
                                                           const PublishedPose& pose) const;

  /// tf of what rviz follows: ~view_frame, where the camera is in the world; of an object also its middle,
  /// with its axes (~view_frame with _object behind it). Nothing when none is wanted.
  std::vector<geometry_msgs::TransformStamped> view_transforms(const std_msgs::Header& image_header,
                                                               const Rigid3& world_from_camera) const;

 private:
  bool is_centred() const { return options_.object_origin == "centre"; }
  std::string camera_frame(const std_msgs::Header& image_header) const;
  std::optional<Rigid3> look_up(const std::string& parent, const std::string& child,
                                const ros::Time& stamp) const;
  bool mixes_units(const std::string& camera, ScaleSource scale) const;
  void tell_ways_to_metres() const;
  std::chrono::steady_clock::time_point deadline_of(const ros::Time& stamp) const;
  bool wait_for_transform(const std::string& parent, const std::string& child, const ros::Time& stamp,
                          std::string* why) const;
  std::string view_problem(const std::string& camera) const;
  std::string conflict(const std::string& parent, const std::string& child) const;

  const FrameOptions options_;
  const Warn warn_;
  tf2_ros::Buffer buffer_;  // locks for itself
  // Those who wait for tf are woken when there is more of it.
  mutable std::mutex tf_mutex_;  // guards what follows
  mutable std::condition_variable tf_changed_;
  std::uint64_t tf_changes_ = 0;
  bool cancelled_ = false;
  // All look-ups of one image, known by its stamp, end by the same time.
  mutable ros::Time waited_stamp_;
  mutable std::chrono::steady_clock::time_point deadline_;

  boost::signals2::scoped_connection tf_listening_;
  std::unique_ptr<tf2_ros::TransformListener> listener_;

  mutable std::mutex mutex_;  // guards what follows
  ObjectCentre centre_;
};

/// Points and keyframes in the world's frame.
MapSnapshot in_world(const Rigid3& world_from_map, const MapSnapshot& snapshot);

}  // namespace mono_pose_tracker
