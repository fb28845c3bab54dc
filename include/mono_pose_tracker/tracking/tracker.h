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

/// An image, and what was found in it ahead of its turn, when it was not known yet where in it the object is.
/// Tracker::prepare makes it. Made of the image alone, all is done in its turn, with the same result.
struct PreparedImage {
  PreparedImage() = default;
  PreparedImage(const cv::Mat& image_alone) : image(image_alone) {}  // nothing is done ahead

  cv::Mat image;  // CV_8UC1 or CV_8UC3 (BGR)

  std::shared_ptr<const ImagePreparer> by;      // what follows is its work; none: there is nothing
  cv::Mat clearance;                            // where features may be, as far as could be guessed
  ImageFeaturesPtr features;                    // under this guess; none where guesses have been wrong
  std::shared_ptr<FeatureExtractor> extractor;  // that has prepared the image, where guesses have been wrong
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

/// Tracks one camera against the map it builds: bootstraps, resects every frame, hands keyframes to the
/// mapper, which runs inline (repeatable) or on a worker thread of its own.
///
/// Threads: snapshot, view, revision and cancel may be called from any; prepare as well, but not beside
/// set_options or set_load_level. All other calls, those for the end of a recording among them, come from one
/// thread.
class Tracker {
 public:
  enum class Mapping { kInline, kThreaded };

  /// Throws std::invalid_argument on options out of range. before_mapping is called before every job of the
  /// mapper, where it runs: a test makes mapping slow with it.
  Tracker(const TrackerOptions& options, const CameraModel& camera, Mapping mapping,
          std::function<void()> before_mapping = {});
  ~Tracker();  // cancels, joins the worker
  Tracker(const Tracker&) = delete;
  Tracker& operator=(const Tracker&) = delete;

  /// image: CV_8UC1 or CV_8UC3 (BGR), of the camera's size. mask: empty, or CV_8UC1 of the same size, 0 =
  /// ignore.
  FrameReport process(std::int64_t stamp_ns, const PreparedImage& image, const cv::Mat& mask = cv::Mat());

  /// The masks to come are of an object that was found by its motion: nothing of what they leave is far
  /// behind it.
  void expect_object();

  /// The next image of a recording is not looked at; it may be posed in the end.
  void pass_over();

  /// Does ahead that work on an image which need not wait for its turn. process, keep_for_later and
  /// register_image_again take what it returns in place of the image, with the same result. mask: the one
  /// that they will be given. memory: of a recording whose images are looked at more than once; index: of
  /// this one in it.
  PreparedImage prepare(const cv::Mat& image, const cv::Mat& mask = cv::Mat(),
                        FeatureMemory* memory = nullptr, std::int64_t index = -1) const;

  /// Ends what is under way, here and in the mapper, as soon as it can be: the tracker is only fit to be
  /// destroyed then. May be called from any thread.
  void cancel();

  /// Returns when the mapper has nothing left to do: a recording whose mapping is threaded may wait for it.
  void wait();

  /// Drops the map; the epoch grows by one.
  void reset();
  std::uint32_t epoch() const;

  /// The maps as they are, when the keyframes that wait are in them, and the runs that saw them: this one is
  /// the last. Nothing while there is no map.
  std::optional<SavedMaps> copy_maps();
  /// Goes on in maps that were saved, in the one with most keyframes first; the epoch grows. LOST until a
  /// frame is found in one of them; none is ever dropped for being young. Their features must be of this
  /// tracker's descriptor_kind, their cameras may be others. Throws std::invalid_argument when that is not so
  /// or there is no map.
  void load_maps(SavedMaps saved);

  /// The camera may be anywhere: LOST in the maps that there are; the epoch grows by one. Without a map:
  /// reset.
  void restart();

  /// Moves the present map, and all that is reported from the next image or so on, as a whole: a correction.
  /// scale_source: what the map's unit rests on from then on; nothing where that stays. Without a map nothing
  /// happens.
  void transform_map(const Sim3& new_from_map, std::optional<ScaleSource> scale_source);

  /// Leaves out what a LoadLevel says, from the next image on.
  void set_load_level(int level);

  /// Changes what is_changeable (options_table.h), from the next image on; the map stays. Throws
  /// std::invalid_argument on options out of range.
  void set_options(const TrackerOptions& options);

  std::uint64_t revision() const;
  std::shared_ptr<const MapSnapshot> snapshot() const;
  /// What snapshot copies from (map_snapshot.h): costs nothing. Null while there is no map.
  std::shared_ptr<const TrackingMap> view() const;

  /// Every frame posed against the current map, by index. A frame that is no keyframe rides on its reference
  /// keyframe.
  std::vector<RegisteredFrame> trajectory() const;

  /// For the end of a recording. Waits for the mapper, completes tracks, adjusts everything. Of a recording
  /// of two images, which no third can confirm, the two-view result becomes the map. False when there is no
  /// map; the last report says why.
  bool finish();
  /// Poses an image against the finished map, wherever it was in the recording; it joins the trajectory, in
  /// place of the pose that it had.
  FrameReport register_image_again(std::int64_t frame_index, std::int64_t stamp_ns,
                                   const PreparedImage& image, const cv::Mat& mask = cv::Mat());
  /// An image that got no pose, for fill_gaps; what the report says of its mask holds.
  FrameReport keep_for_later(std::int64_t frame_index, std::int64_t stamp_ns, const PreparedImage& image,
                             const cv::Mat& mask = cv::Mat());
  /// Poses the images that were kept, in the finished map: from both sides of each gap, making keyframes on
  /// the way, and where that ends by descriptors alone. The map is finished anew when it has grown.
  void fill_gaps();
  /// Adjusts the poses of the frames between the keyframes to the finished map, by the landmarks that they
  /// were registered by. Returns those that most of these no longer agree on: to be registered by their
  /// images again.
  std::set<std::int64_t> adjust_frames();
  /// The finished map is refined against the view graph of its keyframes (mapping/view_graph.h). Frames that
  /// stood on keyframes that it contradicts: they have no pose any more, and may be registered again.
  std::set<std::int64_t> refine_with_graph();
  /// Whether nothing but the images is to tell an object from what is behind it (segmentation/method: auto),
  /// and the finished map, if there is one, may be of an object: what it shows stays in view.
  bool may_have_background();
  /// The features of a whole image, whatever a mask leaves out of it; no result changes by it. Null when the
  /// image is not of the camera's size.
  ImageFeaturesPtr features_of(const PreparedImage& image);
  /// What stands still in images of a recording while something moves.
  StaticBackground background_of(const std::vector<SeenImage>& images) const;
  /// All maps that could not be joined, finished; the largest, which is the present one, first.
  std::vector<FinishedMap> maps();
  /// Adds what was found out about each, in this order, to its QualityReport. images: of the recording, that
  /// have features.
  void assess_maps(std::int64_t images, std::vector<FinishedMap>* maps);
  /// The finished map.
  /// Of a finished recording: the two-view geometries that its maps were held against.
  const ViewGraph& view_graph();
  const Map& map() const;
  /// The loops that were closed, in any of the maps. Only inline, or after wait().
  const std::vector<ClosedLoop>& loops() const;
  /// Bundle adjustments that failed, each of which left the map as it was. Only inline, or after wait().
  int failed_adjustments() const;
  /// True when the map rests on two views that no third has confirmed.
  bool rests_on_two_views() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mono_pose_tracker
