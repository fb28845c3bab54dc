// What comes by topic to a tracker that runs, in any order: images, calibrations, masks, commands.
#include <boost/make_shared.hpp>
#include <cmath>

#include "common/statistics.h"
#include "fuzz_target.h"
#include "ros/live_tracker.h"
#include "simulation/simulated_sequence.h"

using namespace mono_pose_tracker;

namespace {

constexpr int kWidth = 160, kHeight = 120;
constexpr int kViews = 24;
// So that an input takes a second or two at most, with the sanitizers: enough to begin a map and go on in it.
constexpr int kMostSteps = 60, kMostImages = 16;

struct Room {
  sensor_msgs::CameraInfo info;
  std::vector<cv::Mat> images;
};

// Small images of a room: enough to begin a map, so that what comes later meets a tracker that tracks.
Room make_room() {
  SequenceOptions options;
  options.scene = SceneKind::kRoom;
  options.frames = kViews;
  options.camera = default_camera(SceneKind::kRoom, kWidth, kHeight);
  const SimulatedSequence sequence(options);
  Room result;
  result.info = to_camera_info(sequence.camera().parameters());
  for (int i = 0; i < kViews; ++i) result.images.push_back(sequence.render(i).image);
  return result;
}

// Rendered at the first input: before main() begins, the palettes of the scenes need not be there yet.
const Room& room() {
  static const Room rendered = make_room();
  return rendered;
}

sensor_msgs::ImagePtr to_message(const cv::Mat& image, const ros::Time& stamp) {
  auto message = boost::make_shared<sensor_msgs::Image>();
  message->header.stamp = stamp;
  message->width = static_cast<std::uint32_t>(image.cols);
  message->height = static_cast<std::uint32_t>(image.rows);
  message->encoding = image.channels() == 1 ? "mono8" : "bgr8";
  message->step = static_cast<std::uint32_t>(image.cols * image.elemSize());
  message->data.assign(image.data, image.data + image.total() * image.elemSize());
  return message;
}

TrackerOptions small_options() {
  TrackerOptions options;
  options.sift.max_features = 200;
  options.bundle.max_iterations = 5;
  return options;
}

class Session {
 public:
  explicit Session(FuzzInput* input)
      : input_(*input),
        tracker_(
            small_options(), cameras_, masks_, std::chrono::milliseconds(0), [this] { return masked_; },
            [](const std::string&, const std::string& text) { FUZZ_CHECK(is_one_line(text.c_str())); }) {
    cameras_.set_message(boost::make_shared<sensor_msgs::CameraInfo>(room().info));
  }

  bool goes_on() const { return steps_ < kMostSteps && images_ < kMostImages && !input_.empty(); }

  void step() {
    ++steps_;
    switch (input_.take<std::uint8_t>() % 12) {
      case 0:
        stamp_ns_ = input_.take<std::int64_t>();  // a clock that jumps
        break;
      case 1:
        tracker_.reset();
        break;
      case 2:
        calibrate();
        break;
      case 3:
        cameras_.set_message(boost::make_shared<sensor_msgs::CameraInfo>(room().info));
        break;
      case 4:
        masked_ = !masked_;
        break;
      case 5:
        masks_.put(
            to_message(cv::Mat(kHeight, kWidth, CV_8U, cv::Scalar(input_.take<std::uint8_t>())), stamp()));
        break;
      case 6:
        show(to_message(noise(), stamp()));
        break;
      case 7:
        show(broken_image());
        break;
      case 8:
        change_options();
        break;
      case 9:
        save_and_load();
        break;
      default:
        for (int i = input_.take<std::uint8_t>() % 4; i >= 0; --i) {
          view_ = (view_ + 1) % kViews;
          show(to_message(room().images[view_], stamp()));
        }
    }
  }

 private:
  // ROS holds 32 bits of seconds; the stamp wraps with them.
  ros::Time stamp() {
    stamp_ns_ = static_cast<std::int64_t>(static_cast<std::uint64_t>(stamp_ns_) + 33000000u);
    const auto ns = static_cast<std::uint64_t>(stamp_ns_) & ((1ull << 61) - 1);
    return ros::Time(static_cast<std::uint32_t>(ns / 1000000000 & 0xffffffff),
                     static_cast<std::uint32_t>(ns % 1000000000));
  }

  cv::Mat noise() {
    Random random(input_.take<std::uint8_t>());
    cv::Mat image(kHeight, kWidth, CV_8U);
    for (int i = 0; i < kWidth * kHeight; ++i) image.data[i] = static_cast<std::uint8_t>(random.index(256));
    return image;
  }

  sensor_msgs::ImagePtr broken_image() {
    auto message = to_message(room().images[view_], stamp());
    message->width = input_.take<std::uint32_t>();
    message->height = input_.take<std::uint32_t>();
    message->step = input_.take<std::uint32_t>();
    return message;
  }

  void calibrate() {
    auto info = boost::make_shared<sensor_msgs::CameraInfo>(room().info);
    info->K[0] = input_.take<float>();
    info->K[4] = input_.take<float>();
    info->D.assign(5, input_.take<float>());
    if (input_.take<std::uint8_t>() % 4 == 0) info->width = input_.take<std::uint16_t>();
    cameras_.set_message(info);
  }

  void change_options() {
    TrackerOptions options = small_options();
    options.sift.max_features = 10 + input_.take<std::uint8_t>();
    options.inlier_threshold_px = 0.5 + input_.take<std::uint8_t>() % 8;
    tracker_.set_options(options);
  }

  void save_and_load() {
    try {
      tracker_.load_maps(tracker_.copy_maps());
    } catch (const std::runtime_error& refused) {
      FUZZ_CHECK(is_one_line(refused.what()));  // there is no map, or no calibration
    }
  }

  void show(const sensor_msgs::ImagePtr& message) {
    ++images_;
    const FrameReport report = tracker_.process(message);
    FUZZ_CHECK(report.reason != Reason::kInternalError);
    FUZZ_CHECK(report.epoch >= epoch_);
    epoch_ = report.epoch;
    if (!report.map_from_camera) return;
    FUZZ_CHECK(report.map_from_camera->translation.allFinite());
    FUZZ_CHECK(std::abs(report.map_from_camera->rotation.norm() - 1) < 1e-9);
  }

  FuzzInput& input_;
  CameraSource cameras_{false};
  MaskSource masks_;
  bool masked_ = false;
  LiveTracker tracker_;
  std::int64_t stamp_ns_ = 1000000000;
  int view_ = 0;
  std::uint32_t epoch_ = 0;
  int steps_ = 0, images_ = 0;
};

}  // namespace

FUZZ_TARGET(live_tracker) {
  FuzzInput input(bytes, size);
  Session session(&input);
  while (session.goes_on()) session.step();
}
