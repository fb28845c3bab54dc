#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <std_msgs/Header.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <Eigen/Core>
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

#include "mono_pose_tracker/io/ply.h"
#include "mono_pose_tracker/tracking/frame_report.h"
#include "ros/messages.h"
#include "ros/parameters.h"

namespace mono_pose_tracker {

/// Extent of an object in its map (map units).
struct ObjectBox {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double extent = 0;  // of its longest side
};

/// The box that holds 90 % of the points along each axis of the map, which makes it robust against outliers.
/// Unlike the median, its centre hardly moves when one side of the object has more points. Nothing without
/// points.
std::optional<ObjectBox> box_of(const std::vector<ColoredPoint>& points);

/// The centre of an object whose map grows: taken from the first points, then moved as rarely as possible,
/// because users see each move as a jump. Not locked.
class ObjectCentre {
 public:
  /// Stores the points of the newest revision of a map; the centre does not move.
  void see(std::uint32_t epoch, const std::vector<ColoredPoint>& points);
  /// Whether a frame of this map would be published without a centre.
  bool wants_points(std::uint32_t epoch) const;

  /// Applies the stored points of this map if the centre is wrong by more than kMostOff of the extent or
  /// belongs to another map. Returns the displacement of the centre within the same map.
  std::optional<Eigen::Vector3d> follow(std::uint32_t epoch);

  const Eigen::Vector3d& in_map() const { return box_.centre; }
  double extent() const { return box_.extent; }
  std::uint32_t moves(std::uint32_t epoch) const { return epoch_ == epoch ? moves_ : 0; }

  static constexpr double kMostOff = 0.05;  // of the extent: on a head 1 cm

 private:
  std::optional<std::uint32_t> epoch_, seen_epoch_;
  ObjectBox box_, seen_;
  std::uint32_t moves_ = 0;
};

/// Transforms the tracker's results, which are in the optical axes of the first camera, into the frames
/// selected by the user. Two frames matter: the world (map, or the object), in which points and cameras are
/// given, and the tracked frame (the camera, or the robot's base), whose pose is published.
///
/// May be called from any thread.
class OutputFrames {
 public:
  /// subject: topic of a repeatable warning (LogThrottle).
  using Warn = std::function<void(const std::string& subject, const std::string& text)>;

  /// options: normalised. warn: shows a warning to the user.
  OutputFrames(const FrameOptions& options, Warn warn);
  ~OutputFrames();

  /// Wakes all threads that wait for tf; later calls do not wait.
  void cancel();

  const FrameOptions& options() const { return options_; }

  const std::string& world() const {
    return options_.object_mode ? options_.object_frame : options_.map_frame;
  }

  /// Whether an object's centre in this map needs its points and has none yet.
  bool wants_points(std::uint32_t epoch) const;
  /// Sets the points of the newest revision of an object's map.
  void see_points(std::uint32_t epoch, const std::vector<ColoredPoint>& points);
  /// To be called before a registered frame is published: only here does an object's origin move within a
  /// map. Returns new_world_from_world when it has moved.
  std::optional<Rigid3> follow_object(std::uint32_t epoch);
  /// Number of moves of the origin in this map.
  std::uint32_t origin_moves(std::uint32_t epoch) const;

  /// Pose of the tracker's map in the world.
  Rigid3 world_from_map() const;
  /// Centre of the object in the world, and its extent. Nothing without an object.
  std::optional<ObjectBox> object_in_world() const;
  /// The report with poses and covariance in the world's frame.
  FrameReport in_world(FrameReport report) const;

  /// Pose of the tracked frame in the world; in object mode, of the object in the tracked frame.
  struct PublishedPose {
    std::string frame, child_frame;
    PoseEstimate frame_from_child;
    /// Covariance with the map assumed exact: of the change between consecutive images.
    Eigen::Matrix<double, 6, 6> own_covariance = Eigen::Matrix<double, 6, 6>::Zero();
  };
  /// For a report in the world's frame. Nothing when tf has no transform from base to camera, or when the
  /// map's own units would be mixed with a robot's metres.
  std::optional<PublishedPose> published_pose(const std_msgs::Header& image_header,
                                              const FrameReport& report) const;

  /// Pose of the camera in the map (not the world) for a given pose of the tracked frame. Throws
  /// std::runtime_error if that is unknown, the map is an object, or its units would be mixed with a robot's
  /// metres.
  Rigid3 map_from_camera(const std_msgs::Header& image_header, ScaleSource scale,
                         const Rigid3& world_from_tracked) const;
  /// Pose of the camera by odometry, including its mounting on the robot; nothing without tf.
  std::optional<Rigid3> odom_from_camera(const std_msgs::Header& image_header) const;

  /// The transform for tf; nothing if none is wanted, or if a frame would get a second parent.
  std::optional<geometry_msgs::TransformStamped> transform(const std_msgs::Header& image_header,
                                                           const PublishedPose& pose) const;

  /// Transforms for rviz: ~view_frame, the pose of the camera in the world; in object mode also the object's
  /// centre with its axes (~view_frame with the suffix _object). Nothing when none is wanted.
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
  // Waiting threads are woken when new tf arrives.
  mutable std::mutex tf_mutex_;  // guards what follows
  mutable std::condition_variable tf_changed_;
  std::uint64_t tf_changes_ = 0;
  bool cancelled_ = false;
  // All look-ups of one image, identified by its stamp, share one deadline.
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
