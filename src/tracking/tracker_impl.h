#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "bootstrap_job.h"
#include "feature_memory.h"
#include "frame_maker.h"
#include "innovation_gate.h"
#include "keyframe_policy.h"
#include "map/frame_poses.h"
#include "mapping/mapping_worker.h"
#include "mapping/static_background.h"
#include "mono_pose_tracker/tracking/tracker.h"
#include "object_finder.h"
#include "object_follower.h"
#include "tracking/finished_map.h"
#include "tracking/frame_registrar.h"
#include "tracking/map_snapshot.h"

namespace mono_pose_tracker {

// The predicted pose of an image, and the keyframe with the landmarks to search.
struct Prediction {
  KeyframeId reference = -1;
  Rigid3 camera_from_map;
};

// A pose from descriptors alone that awaits a second consistent view.
struct Tentative {
  std::uint32_t map_id = 0;
  std::int64_t index = 0;
  FramePose pose;
};

// Whether the map was loaded: keyframes of earlier runs are never dropped as part of a young map.
inline bool has_earlier_frames(const TrackingMap& map) {
  return is_of_earlier_run(map.keyframes.begin()->second.frame_index);
}

// Thresholds of the Tracker in addition to the user's TrackerOptions.
struct TrackerLimits {
  std::size_t live_frames = 20000;    // whose poses are corrected with the map: eleven minutes at 30 Hz, as
                                      // long as the default ~path
  std::size_t doubtful_in_a_row = 2;  // poses; after more, all of them are withdrawn
  int objects_left = 2;               // for a head, the shoulders below it and the room behind
  double other_lengths = 0.01;  // relative change of lengths that matters: an object's place is accurate to 2
                                // px at a hundred px or more from its centroid
  // Edges of an image: keyframes nearest in time, before and after, and similar ones.
  std::size_t edges_before = 3, edges_after = 3;
  int similar_edges = 4;
};

// The states of a Tracker and the path of an image through them, in seven files: tracker_states.cpp and
// tracker_accept.cpp track the camera and apply the mapper's corrections, tracker_search.cpp relocalises a
// lost camera and follows the object that rotates, tracker_finish.cpp ends a recording, tracker_gaps.cpp and
// tracker_registration.cpp register the images that have no pose then, tracker_saved_maps.cpp handles maps of
// other runs.
class Tracker::Impl {
 public:
  Impl(const TrackerOptions& options, const CameraModel& camera, Mapping mapping,
       std::function<void()> before_mapping)
      : given_options_(options),
        pace_(mapping == Mapping::kThreaded ? SearchPace::kLive : SearchPace::kRecording),
        options_(options.for_images({camera.width(), camera.height()}, pace_).cancellable(&cancelled_)),
        camera_(camera),
        object_finder_(options_.segmentation, camera),
        frame_maker_(options_.sift, options_.scale, options_.segmentation, camera),
        registrar_(options_, camera),
        keyframe_policy_(options_.mapping, options_.young_map_keyframes),
        bootstrap_job_(options_, camera),
        worker_(options_.mapper(camera.focal()), mapping == Mapping::kThreaded, std::move(before_mapping)) {}
  ~Impl() { cancel(); }

  void cancel() { cancelled_ = true; }
  FrameReport process(std::int64_t stamp_ns, const PreparedImage& image, const cv::Mat& mask);
  void wait();
  void reset();
  void set_options(const TrackerOptions& options);
  void set_load_level(int level);
  std::uint32_t epoch() const { return epoch_; }
  std::optional<SavedMaps> copy_maps();
  void load_maps(SavedMaps saved);
  void restart();
  std::vector<RegisteredFrame> trajectory() const;
  bool finish();
  const FrameMaker& frame_maker() const { return frame_maker_; }
  MappingWorker& worker() { return worker_; }

  // For a recording; called by one thread.

  // Later masks are of an object found by its motion, so that masked features have no far background.
  void expect_object() { expects_object_ = true; }
  // Skips the next image; it may be registered in the end.
  void pass_over() { ++next_index_; }
  // Registers an image in the finished map, wherever it was in the recording. The new pose replaces the
  // previous one in the trajectory; an image that is not registered, and no keyframe, has no pose any more.
  FrameReport register_image_again(std::int64_t frame_index, std::int64_t stamp_ns,
                                   const PreparedImage& image, const cv::Mat& mask = cv::Mat());
  // Stores an unregistered image for fill_gaps; the mask in the report is valid.
  FrameReport keep_for_later(std::int64_t frame_index, std::int64_t stamp_ns, const PreparedImage& image,
                             const cv::Mat& mask = cv::Mat());
  // Registers the stored images in the finished map: from both sides of each gap, making keyframes on the
  // way, and by descriptors alone beyond. The map is finished again when it has grown.
  void fill_gaps();
  // Adjusts the poses of the frames between keyframes to the finished map, by the landmarks by which they
  // were registered. Returns the frames with which most of these are no longer consistent: they are to be
  // registered by their images again.
  std::set<std::int64_t> adjust_frames(const TrackingMap& map);
  // Refines the finished map against the view graph of its keyframes (mapping/view_graph.h). Returns the
  // frames relative to keyframes that the graph contradicts: they no longer have a pose and may be registered
  // again.
  std::set<std::int64_t> refine_with_graph();
  // Removes the poses of images that the images without a pose contradict (unsupported_images), and adjusts
  // the map without them. Returns them; other frames may have lost their pose with a keyframe.
  std::set<std::int64_t> withdraw_unsupported();
  // Whether an object is separated from its background by the images alone (segmentation/method: auto), and
  // the finished map, if there is one, may be of an object: its landmarks stay in view.
  bool may_have_background();
  // The unmasked features of an image; no result depends on the call. Null when the image does not have the
  // camera's size.
  ImageFeaturesPtr features_of(const PreparedImage& image);
  // The static background in images of a recording while something moves.
  StaticBackground background_of(const std::vector<SeenImage>& images) const;
  // All maps that could not be merged, finished; the largest, which is the present one, first.
  std::vector<FinishedMap> maps();
  // Adds the findings about each map, in this order, to its QualityReport. images: number of images of the
  // recording with features.
  void assess_maps(std::int64_t images, std::vector<FinishedMap>* maps);
  // The two-view geometries of a finished recording, with which its maps were compared.
  ViewGraph& view_graph() { return worker_.mapper().view_graph(); }

 private:
  // Candidate reference keyframes of a pose: those near the last tracked frame, or all.
  enum class Among { kNear, kAll };

  FinishedMap finished();
  std::set<std::int64_t> erase_frames_on(const TrackingMap& before, const std::set<KeyframeId>& removed);
  std::vector<RegisteredImage> seen_in(const FinishedMap& map) const;
  MotionSegmentationOptions motion_options() const;
  void assess_independent_motion(FinishedMap* map);
  bool goes_through(const Map& map) const;
  void choose_masks(const Frame& frame, const TrackingMap& map, const Rigid3& camera_from_map);
  bool shows_background(const TrackingMap& view, const Map& map);
  bool looks_for_background() const {
    return options_.segmentation.is_automatic() && !options_.localize_only;
  }
  void apply_options();
  void begin_anew();
  // The object that rotates is wanted: the features of the images are stored to find it in the end.
  bool keeps_seen() const {
    return pace_ == SearchPace::kRecording && options_.segmentation.wants_turning_object();
  }
  std::optional<Frame> make_frame(std::int64_t index, std::int64_t stamp_ns, const PreparedImage& image,
                                  const Segmentation& segmentation, FrameReport* report);
  void bootstrap(const Frame& frame, FrameReport* report);
  void track(const Frame& frame, FrameReport* report);
  void lose(const Frame& frame, const Frame& of_object, FrameReport* report);
  std::optional<Rigid3> last_pose(const TrackingMap& map) const;
  RegistrationReport follow(const Frame& frame, const TrackingMap& map) const;
  bool search(const Frame& frame, FrameReport* report);
  void end_loss() { frames_lost_ = 0, seeks_additional_map_ = false; }
  bool confirm(const Frame& frame, TrackingMapPtr* map, RegistrationReport* registration);
  bool switch_to_other_object(const TrackingMap& map, const Frame& frame, FrameReport* report);
  void drop_young_map(FrameReport* report);
  void bootstrap_additional(const Frame& frame, FrameReport* report);
  void change_map(const std::function<void(Mapper&)>& change);
  bool go_back_to(std::uint32_t map_id, bool keep_present);
  void apply_corrections(const TrackingMap& map);
  void follow_mapper();
  void forget_dropped_maps(const TrackingMap& map);
  bool accept(const Frame& frame, const TrackingMap& map, const RegistrationReport& registration,
              FrameReport* report);
  void merge_and_finish();
  void resume_largest();
  std::optional<Frame> make_frame_again(std::int64_t frame_index, std::int64_t stamp_ns,
                                        const PreparedImage& image, const cv::Mat& mask, FrameReport* report);
  bool is_found(const RegistrationReport& registration) const;
  FramePose pose_of(const Frame& frame, const TrackingMap& map, const RegistrationReport& registration,
                    Among among) const;
  FramePose set_pose(const Frame& frame, const TrackingMap& map, const RegistrationReport& registration,
                     Among among, bool is_final = false);
  std::optional<Prediction> predict_from_neighbor(const Frame& frame, std::int64_t neighbor) const;
  bool register_in_gap(const Frame& frame, const std::optional<Prediction>& prediction);
  LandmarkPixels pixels_of_landmarks(const ImageFeatures& image,
                                     const std::vector<FrameObservation>& observations) const;
  bool fill_gaps_once();
  void fill_its_gaps();
  void exclude_registered();
  void fill_gaps_in_other_maps();
  std::vector<std::uint32_t> all_maps();
  void show(std::uint32_t map_id);
  void begin_in_gaps();
  bool track_in_gap(const Frame& frame);
  void drop_young_maps(const std::set<std::uint32_t>& known);
  RegistrationReport register_near_in_time(const Frame& frame, const TrackingMap& map,
                                           std::size_t keyframes) const;
  std::map<KeyframeId, int> connected_to(const Frame& frame, const TrackingMap& map,
                                         const std::vector<KeyframeId>& keyframes);
  std::optional<Rigid3> pose_by_landmarks(const TrackingMap& map, const std::vector<LandmarkPixel>& landmarks,
                                          const Rigid3& initial);
  std::optional<bool> agrees_with_graph(const Frame& frame, const std::map<KeyframeId, int>& nodes,
                                        const TrackingMap& map, const Rigid3& camera_from_map);
  RegistrationReport register_image(const Frame& frame, const TrackingMap& map,
                                    const std::optional<Prediction>& prediction);
  RegistrationReport register_again(const Frame& frame, const TrackingMap& map);
  bool withdraw_doubtful(const Frame& frame, const TrackingMap& map, FrameReport* report);
  KeyframeCandidate candidate_of(const Frame& frame, const TrackingMap& map, const FramePose& pose,
                                 const RegistrationReport& registration) const;
  void insert_keyframe(const Frame& frame, const TrackingMap& map, const FramePose& pose,
                       const RegistrationReport& registration, FrameReport* report);
  bool is_doubtful(const Frame& frame, const RegistrationReport& registration,
                   const std::optional<Rigid3>& last, FrameReport* report);
  KeyframeId choose_reference(const TrackingMap& map, const RegistrationReport& registration,
                              Among among) const;
  void start_map();
  RegistrationReport begin_in_new_map(const Frame& frame, const BootstrapReport& bootstrap,
                                      FrameReport* report);
  void describe(const RegistrationReport& registration, FrameReport* report) const;
  Frame followed(const Frame& frame, FrameReport* report);
  RegistrationReport locate(const Frame& frame, TrackingMapPtr* map, Frame* of_object, FrameReport* report);
  void finish_report(FrameReport* report);
  bool is_of_motion_now() const;
  bool is_corrected_since(const TrackingMap& map) const;
  void report_corrections(const TrackingMap& map, FrameReport* report);

  std::atomic<bool> cancelled_{false};
  TrackerOptions given_options_;
  const SearchPace pace_;
  int load_level_ = 0;
  TrackerOptions options_;  // given_options_ adapted to the camera's images
  const CameraModel camera_;
  const TrackerLimits limits_;
  ObjectFinder object_finder_;
  FrameMaker frame_maker_;
  FrameRegistrar registrar_;
  KeyframePolicy keyframe_policy_;
  InnovationGate innovation_gate_;
  BootstrapJob bootstrap_job_;
  MappingWorker worker_;  // last: its thread uses the members above

  State state_ = State::kBootstrapping;
  std::uint32_t epoch_ = 0;
  std::int64_t next_index_ = 0;
  std::int64_t frames_excluded_ = 0;  // of these: of another size, or without features
  bool rests_on_two_views_ = false;
  bool expects_object_ = false;          // masks are of an object found by its motion
  std::vector<MapSession> sessions_;     // of maps from a file; empty: none
  BootstrapReport bootstrap_;            // the last known report
  std::uint64_t reported_revision_ = 0;  // of the map with the last reported mapping times

  // The last registered frame and its motion since the one before.
  KeyframeId reference_ = -1;
  Rigid3 camera_from_reference_;
  std::optional<Rigid3> motion_;  // camera now from camera one frame ago
  int frames_lost_ = 0;
  std::deque<std::int64_t> doubted_;  // consecutive doubtful frames, as innovation_gate_ counts them
  std::set<std::int64_t> withdrawn_;  // frames of a recording with consecutive doubtful poses
  std::optional<ObjectFollower> object_follower_;  // live: the object to be mapped; nothing: no choice
  int objects_abandoned_ = 0;  // consecutive maps dropped because another object rotated more

  std::map<std::uint32_t, FramePoses> frames_;      // by map
  std::map<std::uint32_t, TrackingMapPtr> others_;  // inactive maps, by id
  std::optional<Tentative> tentative_;
  std::uint64_t corrections_ = 0;                           // sequence of the last one applied
  std::map<std::uint32_t, std::uint32_t> times_corrected_;  // by map
  std::map<std::int64_t, Frame> unregistered_;              // of a finished recording
  SeenImages seen_;                                         // of registered images of a recording
  bool grown_ = false;                                      // whether the finished map has grown
  std::pair<std::uint32_t, std::uint64_t> reported_;        // map and correction of the last report
  std::uint32_t present_map_ = 0;                           // id of the map of reference_
  std::uint32_t motion_map_ = 0;                // map of the object found by object_finder_; 0: none
  ScaleSource scale_ = ScaleSource::kMapUnits;  // unit of the lengths relative to reference_
  double length_scale_ = 1;                     // product of the corrections since the last report
  std::uint32_t searches_ = 0;                  // number of searches for an additional map
  bool seeks_additional_map_ = false;           // the last search is still running
};

}  // namespace mono_pose_tracker
