#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/image_source.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "mono_pose_tracker/evaluation/trajectory_error.h"
#include "mono_pose_tracker/io/ply.h"
#include "mono_pose_tracker/io/trajectory.h"
#include "pipeline/recording.h"

namespace mono_pose_tracker {

/// An image of a recording as the page shows it.
struct SceneImage {
  enum class State { kRegistered = 0, kUncertain = 1, kNotRegistered = 2 };

  std::string name;
  std::optional<double> time;  // s
  std::optional<Rigid3> map_from_camera;
  State state = State::kRegistered;
  bool is_keyframe = false;
  int inliers = -1;                     // -1: not known
  std::optional<double> error;          // distance to a reference, in the page's unit
  std::vector<std::string> notes;       // what was found about it
  std::vector<std::uint8_t> thumbnail;  // JPEG; may be empty
};

/// A map and its cameras, to look at in a browser. Images are in the recording's order; an image without a
/// pose breaks the path.
struct ScenePage {
  std::string title;
  std::string unit = "map units";
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();      // in the map, any length
  double tan_half_width = 0.5, tan_half_height = 0.4;  // of the view's angle: the shape of the frusta
  std::vector<ColoredPoint> points;
  std::vector<SceneImage> images;
  std::vector<std::pair<std::int64_t, std::int64_t>> loops;  // of images
  std::vector<std::string> findings;                         // about all of it
  std::vector<Eigen::Vector3d> reference;                    // a second path; may be empty
  double worst_error = 0;                                    // 0: paths are coloured by time, else by error
};

struct ScenePageOptions {
  /// Of more points an evenly spread selection is written. 200,000 take 4 MB.
  std::size_t max_points = 200000;
  /// Of larger thumbnails together, every second, third, ... image keeps its own. 6.5 MB take 8.7 MB as text.
  std::size_t max_thumbnail_bytes = 6500000;
};

/// Writes one HTML file that needs nothing else: no request leaves it. Throws std::runtime_error naming the
/// path when it cannot be written.
void write_scene_page(const std::string& path, const ScenePage& page, const ScenePageOptions& options = {});

/// scene_page.html of this folder, which the build turns into a string; @SCENE@ stands where the data go.
extern const char kScenePageText[];

struct ThumbnailOptions {
  int max_side_px = 160;  // of the longer side
  int jpeg_quality = 70;  // 0 to 100
};

/// Thumbnails of the images of a recording, by index, made while these are read. May be used by any thread.
class Thumbnails {
 public:
  explicit Thumbnails(const ThumbnailOptions& options = {}) : options_(options) {}

  void add(std::int64_t index, const cv::Mat& image);
  /// JPEG; empty where there is none.
  std::vector<std::uint8_t> of(std::int64_t index) const;

 private:
  const ThumbnailOptions options_;
  mutable std::mutex mutex_;
  std::map<std::int64_t, std::vector<std::uint8_t>> jpegs_;
};

/// The source, with thumbnails made of the images as they are read.
std::unique_ptr<ImageSource> with_thumbnails(std::unique_ptr<ImageSource> source,
                                             std::shared_ptr<Thumbnails> thumbnails);

/// Data from the frame reports that RecordingResult does not keep, by frame index.
class FrameNotes {
 public:
  void add(std::int64_t index, const FrameReport& report);
  std::optional<double> time(std::int64_t index) const;  // s
  int inliers(std::int64_t index) const;                 // -1: not known
  std::string reason(std::int64_t index) const;          // why its pose is missing or uncertain; may be empty

 private:
  struct Note {
    std::int64_t stamp_ns = 0;
    int inliers = -1;
    std::string reason;
  };
  std::map<std::int64_t, Note> notes_;
};

/// The page of one of the result's maps.
ScenePage recording_page(const RecordingResult& result, const FinishedMap& map,
                         const CameraParameters& camera, const FrameNotes& notes,
                         const Thumbnails& thumbnails);

/// An estimated trajectory and its error against the reference.
struct EvaluatedPath {
  std::vector<StampedPose> poses;
  TrajectoryError error;
};

/// The page of the reference and of the estimates, aligned to it and coloured by their errors of position.
ScenePage evaluation_page(const std::vector<StampedPose>& reference, const std::vector<EvaluatedPath>& paths);

}  // namespace mono_pose_tracker
