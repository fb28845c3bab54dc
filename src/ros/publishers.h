#pragma once

#include <image_transport/image_transport.h>
#include <nav_msgs/Path.h>
#include <ros/node_handle.h>
#include <ros/single_subscriber_publisher.h>
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
#include <utility>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/tracking/frame_report.h"
#include "ros/live_tracker.h"
#include "ros/messages.h"
#include "ros/output_frames.h"
#include "ros/reporting.h"

namespace mono_pose_tracker {

/// A latched topic whose message is made for subscribers only: a new subscriber gets the present one.
/// roscpp's own latch would have to be updated without subscribers, or would send an outdated message,
/// perhaps of a deleted map.
template <typename Message>
class OnDemandPublisher {
 public:
  using Make = std::function<std::optional<Message>()>;  // nothing: there is none yet
  using Tell = std::function<void(const std::string&)>;  // what went wrong for a new subscriber

  /// make and tell are called by the handle's queue, make by publish() as well.
  OnDemandPublisher(ros::NodeHandle handle, const std::string& topic, Make make, Tell tell)
      : make_(std::move(make)), tell_(std::move(tell)) {
    const ros::SubscriberStatusCallback welcome = [this](const ros::SingleSubscriberPublisher& subscriber) {
      guarded(
          [&] {
            if (const std::optional<Message> message = make_()) subscriber.publish(*message);
          },
          tell_);
    };
    constexpr bool kLatched = true;
    latch_ = handle.advertise<Message>(topic, 1, kLatched);
    publisher_ = handle.advertise<Message>(topic, 1, welcome);
  }
  /// Returns when a running callback has ended.
  ~OnDemandPublisher() {
    publisher_.shutdown();
    latch_.shutdown();
  }
  OnDemandPublisher(const OnDemandPublisher&) = delete;
  OnDemandPublisher& operator=(const OnDemandPublisher&) = delete;

  /// Publishes to all subscribers; nothing is made without one.
  void publish() const {
    if (publisher_.getNumSubscribers() == 0) return;
    if (const std::optional<Message> message = make_()) publisher_.publish(*message);
  }

 private:
  const Make make_;
  const Tell tell_;
  ros::Publisher publisher_;
  /// Of the same topic, and nothing is ever published with it, so that it keeps nothing: it makes the topic
  /// say that it is latched, as a process must know in which a second subscriber shares the first one's
  /// connection.
  ros::Publisher latch_;
};

/// Publishes everything except ~status and /diagnostics. The processing thread calls publish_frame, a timer
/// calls publish_map and publish_path; the mutex guards shared data. Messages whose size grows with the map
/// or the path are made for subscribers only.
class Publishers {
 public:
  /// tell: reports an error while a new subscriber was served; called by the handle's queue.
  Publishers(const OutputFrames& frames, int path_max_length, ros::NodeHandle private_handle,
             const std::function<void(const std::string&)>& tell);

  /// header: of the image; arrival: its time of arrival by ROS's clock; report: in the world's frame. A
  /// report without a pose publishes nothing (but a new map starts a new path).
  void publish_frame(const std_msgs::Header& header, const ros::Time& arrival, const FrameReport& report);

  /// Whether the last pose was not published: it is in another map than the one in which a robot plans
  /// (~odom_frame), and their relation is unknown.
  bool withholds_pose() const { return withholds_pose_; }

  /// Called by a command between two frames: the map of the previous poses has been deleted.
  void drop_map();

  /// Called before the first frame in the new world frame: moves everything published so far. A correction.
  void move_world(const Rigid3& new_world_from_world);

  bool debug_image_wanted() const { return debug_image_.getNumSubscribers() > 0; }
  void publish_debug_image(const std_msgs::Header& header, const cv::Mat& bgr) const;

  /// 255 = the object; published only while someone listens.
  void publish_mask(const std_msgs::Header& header, const cv::Mat& mask, const cv::Size& image_size) const;

  /// Sets the present map, placed in the world like the frame with its stamp. An object turns with each
  /// frame: its points are published with each pose, so that they agree with its tf. Returns false (to be
  /// called again) before the first pose in an object's map, because tf has no transform yet.
  bool publish_map(std::uint32_t epoch, const std::shared_ptr<const DrawnMap>& map,
                   const CameraParameters& camera);

  /// Publishes map -> odom again for the present time, also while there is no pose. While a new map is
  /// tracked that is not joined with the map of this transform, the transform stays.
  void repeat_transform();

  /// Publishes path and camera positions if they have changed.
  void publish_path();

  /// The reported poses of the present map, by stamp (the last path_max_length ones).
  std::vector<KeyframePose> trajectory() const;

 private:
  /// A frame's entry on ~path (pose of the tracked frame) and on ~camera_positions.
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
  /// For visualisation: the frame that rviz follows, and the camera's frustum.
  void publish_view(const std_msgs::Header& image_header, const FrameReport& report);
  /// Header of messages about the whole map; the mutex is held.
  std_msgs::Header header_locked() const;
  /// A map, and its pose in the world at the header's stamp.
  struct PlacedMap {
    std_msgs::Header header;
    Rigid3 world_from_map;
    std::shared_ptr<const DrawnMap> map;
    CameraParameters camera;
    double frustum_depth = 0;
  };
  bool is_placed_locked() const;
  std::optional<PlacedMap> placed_map() const;

  // Make the present messages.
  std::optional<nav_msgs::Path> path() const;
  std::optional<sensor_msgs::PointCloud2> camera_positions() const;
  std::optional<sensor_msgs::PointCloud2> points() const;
  std::optional<visualization_msgs::MarkerArray> keyframes() const;

  const OutputFrames& frames_;
  const std::size_t path_max_length_;
  tf2_ros::TransformBroadcaster broadcaster_;
  ros::Publisher pose_, odometry_, camera_frustum_;
  image_transport::Publisher debug_image_, mask_;

  // The previous frame, if it was registered; for the processing thread only
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

  // Last member, so that it is destroyed first: the callbacks read all of the above.
  OnDemandPublisher<nav_msgs::Path> path_;
  OnDemandPublisher<sensor_msgs::PointCloud2> points_, camera_positions_;
  OnDemandPublisher<visualization_msgs::MarkerArray> keyframes_;
};

}  // namespace mono_pose_tracker
