#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/stage_timer.h"
#include "mono_pose_tracker/features/sift.h"
#include "mono_pose_tracker/io/map_file.h"
#include "mono_pose_tracker/map/image_features.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/tracking/frame_report.h"
#include "mono_pose_tracker/tracking/tracker_options.h"

namespace mono_pose_tracker {

class ImagePreparer;

/// An image, and the results of work on it ahead of its turn, before the object's mask is known.
/// Tracker::prepare makes it. Made from the image alone, all work is done in its turn, with the same result.
struct PreparedImage {
  PreparedImage() = default;
  PreparedImage(const cv::Mat& image_alone) : image(image_alone) {}  // no work is done ahead

  cv::Mat image;  // CV_8UC1 or CV_8UC3 (BGR)

  std::shared_ptr<const ImagePreparer> by;      // made the members below; none: there are none
  cv::Mat clearance;                            // where features are allowed, by a guessed mask
  ImageFeaturesPtr features;                    // with the guessed mask; none where guesses were wrong
  std::shared_ptr<FeatureExtractor> extractor;  // with the prepared image, where guesses were wrong
  StageTimes stages;
};

class FeatureMemory;
struct Sim3;
struct TrackingMap;

/// Tracks one camera in the map that it builds: bootstraps, registers every frame, and passes keyframes to
/// the mapper, which runs inline (repeatable) or on a worker thread of its own.
///
/// Threads: snapshot, view, revision and cancel may be called from any thread; prepare as well, but not
/// concurrently with set_options or set_load_level. All other calls, including those for the end of a
/// recording, come from one thread.
class Tracker {
 public:
  enum class Mapping { kInline, kThreaded };

  /// Throws std::invalid_argument on options out of range. before_mapping is called before every job of the
  /// mapper on the job's thread, so that a test can delay mapping.
  Tracker(const TrackerOptions& options, const CameraModel& camera, Mapping mapping,
          std::function<void()> before_mapping = {});
  ~Tracker();  // cancels, joins the worker
  Tracker(const Tracker&) = delete;
  Tracker& operator=(const Tracker&) = delete;

  /// image: CV_8UC1 or CV_8UC3 (BGR), of the camera's size. mask: empty, or CV_8UC1 of the same size, 0 =
  /// ignore.
  FrameReport process(std::int64_t stamp_ns, const PreparedImage& image, const cv::Mat& mask = cv::Mat());

  /// Does work on an image ahead of its turn. process accepts the returned value in place of the image, with
  /// the same result. mask: the mask that will be given with it. memory: cache for a recording whose images
  /// are processed more than once; index: of this image in the recording.
  PreparedImage prepare(const cv::Mat& image, const cv::Mat& mask = cv::Mat(),
                        FeatureMemory* memory = nullptr, std::int64_t index = -1) const;

  /// Stops running work of the tracker and the mapper as soon as possible. Afterwards the tracker may only be
  /// destroyed. May be called from any thread.
  void cancel();

  /// Returns when the mapper has no work left: a recording with threaded mapping may wait for it.
  void wait();

  /// Drops the map and increments the epoch.
  void reset();
  std::uint32_t epoch() const;

  /// Copies all maps, after the waiting keyframes are inserted, with the runs that contributed to them; this
  /// run is the last. Nothing while there is no map.
  std::optional<SavedMaps> copy_maps();
  /// Continues in saved maps, first in the one with most keyframes; increments the epoch. The state is LOST
  /// until a frame is registered in one of them; none is dropped for being young. Their features must have
  /// this tracker's descriptor_kind; their cameras may differ. Throws std::invalid_argument where that does
  /// not hold or there is no map.
  void load_maps(SavedMaps saved);

  /// The camera may be anywhere: the state becomes LOST in the existing maps, and the epoch is incremented.
  /// Without a map: reset.
  void restart();

  /// Applies a similarity to the present map and to all reports from about the next image on: a correction.
  /// scale_source: new source of the map's unit; nothing: unchanged. No effect without a map.
  void transform_map(const Sim3& new_from_map, std::optional<ScaleSource> scale_source);

  /// Skips the work of a LoadLevel, from the next image on.
  void set_load_level(int level);

  /// Sets the changeable options (options_table.h), from the next image on; the map stays.
  /// Throws std::invalid_argument on options out of range.
  void set_options(const TrackerOptions& options);

  std::uint64_t revision() const;
  std::shared_ptr<const MapSnapshot> snapshot() const;
  /// The data from which snapshot copies (map_snapshot.h), without a copy. Null while there is no map.
  std::shared_ptr<const TrackingMap> view() const;

  /// All frames registered in the current map, by index. The pose of a frame that is no keyframe is stored
  /// relative to its reference keyframe.
  std::vector<RegisteredFrame> trajectory() const;

  /// Ends a recording: waits for the mapper, merges maps, completes tracks, adjusts everything. For a
  /// recording of two images, which no third can confirm, the two-view result becomes the map. Returns false
  /// when there is no map; the last report has the reason.
  bool finish();
  /// The finished map.
  const Map& map() const;

  class Impl;  // tracking/tracker_impl.h, a private header
  /// More calls for the end of a recording.
  Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace mono_pose_tracker
