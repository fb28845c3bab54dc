#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
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
struct ClosedLoop;
struct FinishedMap;
struct SeenImage;
struct StaticBackground;
struct TrackingMap;
class ViewGraph;

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

  /// Later masks are of an object found by its motion, so that masked features have no far background.
  void expect_object();

  /// Skips the next image of a recording; it may be registered in the end.
  void pass_over();

  /// Does work on an image ahead of its turn. process, keep_for_later and register_image_again accept the
  /// returned value in place of the image, with the same result. mask: the mask that will be given with it.
  /// memory: cache for a recording whose images are processed more than once; index: of this image in the
  /// recording.
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

  /// Sets the changeable options (is_changeable in options_table.h), from the next image on; the map stays.
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
  /// Registers an image in the finished map, wherever it was in the recording. The new pose replaces the
  /// previous one in the trajectory; an image that is not registered, and no keyframe, has no pose any more.
  FrameReport register_image_again(std::int64_t frame_index, std::int64_t stamp_ns,
                                   const PreparedImage& image, const cv::Mat& mask = cv::Mat());
  /// Stores an unregistered image for fill_gaps; the mask in the report is valid.
  FrameReport keep_for_later(std::int64_t frame_index, std::int64_t stamp_ns, const PreparedImage& image,
                             const cv::Mat& mask = cv::Mat());
  /// Registers the stored images in the finished map: from both sides of each gap, making keyframes on the
  /// way, and by descriptors alone beyond. The map is finished again when it has grown.
  void fill_gaps();
  /// Adjusts the poses of the frames between keyframes to the finished map, by the landmarks by which they
  /// were registered. Returns the frames with which most of these are no longer consistent: they are to be
  /// registered by their images again.
  std::set<std::int64_t> adjust_frames();
  /// Refines the finished map against the view graph of its keyframes (mapping/view_graph.h). Returns the
  /// frames relative to keyframes that the graph contradicts: they no longer have a pose and may be
  /// registered again.
  std::set<std::int64_t> refine_with_graph();
  /// Whether an object is separated from its background by the images alone (segmentation/method: auto), and
  /// the finished map, if there is one, may be of an object: its landmarks stay in view.
  bool may_have_background();
  /// The unmasked features of an image; no result depends on the call. Null when the image does not have the
  /// camera's size.
  ImageFeaturesPtr features_of(const PreparedImage& image);
  /// The static background in images of a recording while something moves.
  StaticBackground background_of(const std::vector<SeenImage>& images) const;
  /// All maps that could not be merged, finished; the largest, which is the present one, first.
  std::vector<FinishedMap> maps();
  /// Adds the findings about each map, in this order, to its QualityReport. images: number of images of the
  /// recording with features.
  void assess_maps(std::int64_t images, std::vector<FinishedMap>* maps);
  /// The two-view geometries of a finished recording, with which its maps were compared.
  const ViewGraph& view_graph();
  /// The finished map.
  const Map& map() const;
  /// The closed loops of all maps. Only inline, or after wait().
  const std::vector<ClosedLoop>& loops() const;
  /// Number of failed bundle adjustments; each left the map unchanged. Only inline, or after wait().
  int failed_adjustments() const;
  /// Whether the map has two views that no third confirmed.
  bool rests_on_two_views() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mono_pose_tracker
