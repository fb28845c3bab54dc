#pragma once

#include <image_transport/image_transport.h>
#include <nav_msgs/Path.h>
#include <ros/node_handle.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>
#include <tf2_ros/transform_broadcaster.h>
#include <visualization_msgs/MarkerArray.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/tracking/frame_report.h"
#include "ros/drawn_map.h"
#include "ros/messages.h"
#include "ros/on_demand_publisher.h"
#include "ros/output_frames.h"

namespace mono_pose_tracker {

/// Everything the nodelet says but ~status and /diagnostics. publish_frame is called by the processing
/// thread, publish_map and publish_path by a timer; the mutex guards what they share. What grows with the map
/// or the way is made only while someone listens.
class Publishers {
 public:
  /// tell: what went wrong while a new subscriber was served; called by the handle's queue.
  Publishers(const OutputFrames& frames, int path_max_length, ros::NodeHandle private_handle,
             const std::function<void(const std::string&)>& tell);

  /// header: the image's; arrival: when it came, by ROS's clock; report: in the world's frame. A report
  /// without a pose publishes nothing (but starts the path anew with a new map).
  void publish_frame(const std_msgs::Header& header, const ros::Time& arrival, const FrameReport& report);

  /// Whether the last pose is in a map beside the one that a robot plans in (~odom_frame), and nobody knows
  /// where that lies: it is not given out.
  bool withholds_pose() const { return withholds_pose_; }

  /// By command, between two frames: the poses so far are of a map that is no more.
  void drop_map();

  /// Before the frame from which on it holds: what was given so far lies elsewhere in the world. A
  /// correction.
  void move_world(const Rigid3& new_world_from_world);

  bool debug_image_wanted() const { return debug_image_.getNumSubscribers() > 0; }
  void publish_debug_image(const std_msgs::Header& header, const cv::Mat& bgr) const;

  /// 255 = the object; published only while someone listens.
  void publish_mask(const std_msgs::Header& header, const cv::Mat& mask, const cv::Size& image_size) const;

  /// The map as it is from now on, placed in the world as the frame was whose stamp it gets. An object turns
  /// with each frame: its points are sent again with each pose, lest they stay behind its tf; and not at all
  /// (false: to be given again) before the first pose in this map, as no tf says where they are.
  bool publish_map(std::uint32_t epoch, const std::shared_ptr<const DrawnMap>& map,
                   const CameraParameters& camera);

  /// map -> odom once more, as if the robot went on as it did, also while there is no pose: for those who
  /// want to know where it is now. While a new map is tracked in beside the one that it is of, it stays as it
  /// was: where one is in the other is not known until they are joined.
  void repeat_transform();

  /// Path and camera positions, if there are new ones.
  void publish_path();

  /// The poses of the present map, as they were reported, by stamp (the last path_max_length ones).
  std::vector<KeyframePose> trajectory() const;

 private:
  /// A frame's place on ~path, which is the body's, and on ~camera_positions.
  struct PathEntry {
    KeyframePose camera;
    std::optional<OutputFrames::PublishedPose> published;
  };
  bool keeps_odom_of_another_map(const FrameReport& report) const;
  void correct(const std::vector<RegisteredFrame>& frames, const std::optional<PathEntry>& newest);
  void withdraw(const std::vector<std::int64_t>& stamps_ns);
  void remember(const FrameReport& report, const std::optional<OutputFrames::PublishedPose>& published);
  void publish_pose(const std_msgs::Header& image_header, const ros::Time& arrival, const FrameReport& report,
                    const OutputFrames::PublishedPose& published);
  bool tells_velocity(const FrameReport& report) const;
  /// For eyes: the frame that rviz follows, and the camera's frustum.
  void publish_view(const std_msgs::Header& image_header, const FrameReport& report);
  /// Of what belongs to the whole map; the mutex is held.
  std_msgs::Header header_locked() const;
  /// A map, and where it is in the world at the header's stamp.
  struct PlacedMap {
    std_msgs::Header header;
    Rigid3 world_from_map;
    std::shared_ptr<const DrawnMap> map;
    CameraParameters camera;
    double frustum_depth = 0;
  };
  bool is_placed_locked() const;
  std::optional<PlacedMap> placed_map() const;

  // The messages as they are now
  std::optional<nav_msgs::Path> path() const;
  std::optional<sensor_msgs::PointCloud2> camera_positions() const;
  std::optional<sensor_msgs::PointCloud2> points() const;
  std::optional<visualization_msgs::MarkerArray> keyframes() const;

  const OutputFrames& frames_;
  const std::size_t path_max_length_;
  tf2_ros::TransformBroadcaster broadcaster_;
  ros::Publisher pose_, odometry_, camera_frustum_;
  image_transport::Publisher debug_image_, mask_;

  // The frame before, if it was posed; the processing thread's own
  std::optional<StampedEstimate> previous_;
  bool withholds_pose_ = false;
  std::uint32_t previous_epoch_ = 0;

  mutable std::mutex mutex_;                                    // guards what follows
  std::optional<geometry_msgs::TransformStamped> map_to_odom_;  // the last
  std::uint32_t odom_map_ = 0;                                  // that it is of
  ros::Time map_to_odom_arrival_, repeated_stamp_;              // its image's arrival
  std::deque<PathEntry> poses_;
  std::int64_t newest_stamp_ns_ = 0;
  Rigid3 world_from_map_;  // at that stamp
  std::uint32_t epoch_ = 0;
  std::shared_ptr<const DrawnMap> map_;  // the newest that was given, of map_epoch_
  std::uint32_t map_epoch_ = 0;
  bool path_changed_ = false, has_path_ = false;
  bool keyframes_moved_ = false;                  // with the world, since they were published
  std::optional<CameraParameters> drawn_camera_;  // of the newest map that was given
  double frustum_depth_ = 0;                      // map units
  bool camera_is_drawn_ = false;

  // Last, and so gone first: their callbacks read all of the above.
  OnDemandPublisher<nav_msgs::Path> path_;
  OnDemandPublisher<sensor_msgs::PointCloud2> points_, camera_positions_;
  OnDemandPublisher<visualization_msgs::MarkerArray> keyframes_;
};

}  // namespace mono_pose_tracker
