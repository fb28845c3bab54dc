#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "io/image_source.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "scene_page.h"
#include "tracking/recording.h"

namespace mono_pose_tracker {

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

}  // namespace mono_pose_tracker
