#pragma once

#include <dynamic_reconfigure/server.h>
#include <nodelet/nodelet.h>
#include <ros/callback_queue.h>
#include <ros/spinner.h>
#include <std_srvs/Trigger.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "ros/camera_info.h"
#include "ros/debug_image.h"
#include "ros/diagnostics.h"
#include "ros/image_input.h"
#include "ros/live_options.h"
#include "ros/live_tracker.h"
#include "ros/map_placement.h"
#include "ros/output_frames.h"
#include "ros/parameters.h"
#include "ros/publishers.h"
#include "ros/reporting.h"
#include "ros/status_board.h"
#include "ros/trajectory_log.h"

namespace mono_pose_tracker {

/// The tracker as a nodelet, with three threads. The nodelet's queue receives images and calibrations and
/// runs the timer. The processing thread alone uses the tracker. Services run on a thread of their own and
/// pass commands to the processing thread.
class TrackerNodelet : public nodelet::Nodelet {
 public:
  ~TrackerNodelet() override;

 private:
  using Clock = StatusBoard::Clock;

  /// A series of images with growing stamps. A new series needs a new map. Each image names its series, so
  /// that none is missed when its first image is displaced.
  struct Recording {
    std::uint32_t number = 0;
    std::string why;  // it began
  };

  /// An image that waits to be processed.
  struct Frame {
    sensor_msgs::ImageConstPtr image;
    Clock::time_point arrival;
    ros::Time arrival_stamp;  // by ROS's clock
    Recording recording;
  };

  void onInit() override;
  void set_up();
  void tear_down();                                             // at any stage of set_up, and more than once
  void complain(const char* subject, const std::string& text);  // about each subject once in a while
  void subscribe();
  void take_initialpose(const geometry_msgs::PoseWithCovarianceStampedConstPtr& pose);
  void advertise_services();
  void drop_map();
  void offer_live_options();
  void change_options(const LiveOptions& options);
  void advertise_map_services();
  void load_map_at_start();

  void take_image(const sensor_msgs::ImageConstPtr& image);
  void refuse_image(const std_msgs::Header& header, Reason reason, const std::string& text);
  bool clock_went_back();

  void process_images();
  void process(const Frame& frame);
  void follow_object(std::uint32_t epoch);
  void publish(const Frame& frame, const FrameReport& report);
  void draw(const Frame& frame, const FrameReport& report);
  std::optional<ObjectAxes> object_axes(const FrameReport& report) const;
  void say_state(const FrameReport& report);

  void on_timer();
  void check_inputs();
  void check_calibration();
  void check_outputs();
  void publish_map();
  std::string describe_calibration() const;
  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status);

  ros::NodeHandle service_handle();
  /// A parameter that may be set anew before each call of a service; a path as a user may write it.
  std::string path_parameter(const std::string& name, const std::string& at_start);
  /// The same of a file that is written whole; throws where that is the one that grows.
  std::string path_to_replace(const std::string& name, const std::string& at_start);
  using Answer = std::function<std::string()>;  // what was done; throws what went wrong
  void advertise(const std::string& name, Answer answer);
  /// Runs the command between two images and returns its result or throws its exception. The command may
  /// still run after a timeout here: it must own the data it uses.
  template <typename Result>
  Result on_processing_thread(std::function<Result()> command);

  // What goes on is said again after so long: what an image may tell, and what a user has to connect.
  LogThrottle throttle_{std::chrono::seconds(10)}, input_throttle_{std::chrono::seconds(30)};

  NodeParameters parameters_;
  std::unique_ptr<CameraSource> cameras_;
  MaskSource masks_;
  std::unique_ptr<StatusBoard> board_;
  std::unique_ptr<OutputFrames> frames_;
  std::unique_ptr<Publishers> publishers_;
  std::unique_ptr<TrajectoryLog> trajectory_;
  std::unique_ptr<LiveTracker> tracker_;
  std::unique_ptr<MapPlacement> placement_;  // of the processing thread
  std::unique_ptr<ImageSlot<Frame>> slot_;
  std::unique_ptr<WallClockUpdater> diagnostics_;

  ImageSubscriber image_subscriber_;
  ros::Subscriber camera_info_subscriber_, mask_subscriber_, initialpose_subscriber_;
  ros::CallbackQueue service_queue_;
  ros::AsyncSpinner service_spinner_{1, &service_queue_};
  std::vector<ros::ServiceServer> services_;
  ros::WallTimer timer_, tf_timer_;

  boost::recursive_mutex live_mutex_;  // guards live_options_, too
  LiveOptions live_options_;
  std::unique_ptr<dynamic_reconfigure::Server<LiveOptions>> live_server_;

  const Clock::time_point started_ = Clock::now();

  // Of the nodelet's queue
  std::unique_ptr<TimeGuard> time_guard_;
  ros::Time last_clock_;
  Recording recording_;
  std::string input_problem_, output_problem_;
  bool is_calibration_checked_ = false;
  std::size_t told_renewals_ = 0;  // of the trajectory file
  double excess_stale_ = 0;        // images beyond the normal share, up to the last
  TrackerStatus diagnosed_;        // as /diagnostics last told it
  KeyframeMemory keyframe_memory_;
  std::optional<MapVersion> published_map_;

  // Of the processing thread
  DebugImage debug_image_;
  std::uint32_t tracked_recording_ = 0;
  std::optional<State> said_state_;
  std::uint32_t said_epoch_ = 0;

  std::atomic<bool> paused_{false}, stopping_{false};
  std::thread processing_;  // joined by the destructor
};

}  // namespace mono_pose_tracker
