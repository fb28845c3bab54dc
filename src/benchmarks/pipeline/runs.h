#pragma once

#include <sensor_msgs/Image.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "io/image_source.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/io/trajectory.h"
#include "mono_pose_tracker/tracking/tracker_options.h"
#include "ros/camera_info.h"
#include "ros/image_input.h"
#include "ros/live_tracker.h"
#include "tools/json.h"

namespace mono_pose_tracker {

/// An image as a driver would send it, and the same pixels as the tracker reads them.
struct DecodedFrame {
  std::int64_t stamp_ns = 0;
  std::string name;
  sensor_msgs::ImageConstPtr message;
  cv::Mat image;  // shares the message's memory
};

/// `image`: CV_8UC1 or CV_8UC3 (BGR).
DecodedFrame make_decoded_frame(std::int64_t stamp_ns, const std::string& name, const cv::Mat& image);

/// Images in memory, so that neither disk nor decoder is measured.
struct DecodedSequence {
  std::vector<DecodedFrame> frames;
  std::vector<std::string> problems;  // one line for each excluded image
};

/// A folder or a list of images. Throws std::runtime_error, one line, when there is none or the first does
/// not have the camera's size; later ones of another size are excluded.
DecodedSequence decode_images(const std::string& path, int max_frames, const CameraParameters& camera);

/// The sequence as a recording; it must outlive the source.
std::unique_ptr<ImageSource> make_source(const DecodedSequence& sequence);

/// Resident memory of this process in MB (2^20 bytes), as Linux counts it; 0 where /proc does not tell.
double resident_mb();

/// Largest resident memory since the start of the process or since restart_peak().
double peak_resident_mb();
void restart_peak();

/// CPU time of the calling thread, and of all threads of this process. What other programs do hardly moves
/// it.
double thread_cpu_ms();
double process_cpu_ms();

/// Processes images like the nodelet, without a roscore: a slot of one image, a tracking thread, and a
/// mapping thread.
class LivePipeline {
 public:
  using Clock = std::chrono::steady_clock;
  /// Called on the tracking thread after each image tracked; latency: since it was put into the slot.
  using Observer = std::function<void(const FrameReport& report, double frame_ms, double latency_ms)>;

  struct Counts {
    int received = 0, tracked = 0, dropped = 0;
  };

  LivePipeline(const TrackerOptions& options, const CameraParameters& camera, Observer observer);
  ~LivePipeline();
  LivePipeline(const LivePipeline&) = delete;
  LivePipeline& operator=(const LivePipeline&) = delete;

  /// Called by one thread, the camera's. Never waits for the tracker.
  /// due_ns: when a camera would have sent the image, at its own rate. Without it there is no time limit: no
  /// work is skipped, and the image is done when it has also been mapped.
  void put(const sensor_msgs::ImageConstPtr& image, std::optional<std::int64_t> due_ns = std::nullopt);
  /// Returns when every image has been tracked or dropped.
  void wait();
  Counts counts() const;
  /// All frames registered in the present map, with the map after the mapper has finished. To be called after
  /// wait().
  std::vector<RegisteredFrame> trajectory_on_final_map();

 private:
  struct Frame {
    sensor_msgs::ImageConstPtr image;
    Clock::time_point arrival;
    bool in_time = true;  // or when all is done
  };

  void run();

  CameraSource cameras_{false};
  MaskSource masks_;
  LiveTracker tracker_;
  const Observer observer_;
  ImageSlot<Frame> slot_;
  mutable std::mutex mutex_;
  std::condition_variable done_;
  Counts counts_;  // guarded by mutex_
  std::thread thread_;
};

/// Input of a benchmark; the reference may be empty.
struct RunInput {
  const DecodedSequence& sequence;
  const CameraParameters& camera;
  const TrackerOptions& options;
  const std::vector<StampedPose>& reference;
};

/// Processes every frame in order, with the mapper inline, like track_sequence, and then finishes the map.
/// `trajectory`: the final poses.
Json run_offline(const RunInput& input, std::vector<StampedPose>* trajectory);

/// Feeds frames at `rate_hz` like a camera, whether the tracker is ready or not. `offline`: the result of
/// run_offline with which the poses are compared, or empty. Compared are the reported poses, and those of the
/// last map relative to its final keyframes, without offline refinement.
Json run_live(const RunInput& input, double rate_hz, const std::vector<StampedPose>& offline);

/// The run whose median time of a frame is the median one, with `median_ms_of_runs` beside its figures.
Json median_run(std::vector<Json> runs);

}  // namespace mono_pose_tracker
