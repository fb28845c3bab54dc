#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bootstrap_job.h"
#include "frame_maker.h"
#include "innovation_gate.h"
#include "keyframe_policy.h"
#include "map/frame_poses.h"
#include "mapping/mapping_worker.h"
#include "mapping/matches_in_time.h"
#include "mapping/static_background.h"
#include "mono_pose_tracker/tracking/tracker.h"
#include "object_finder.h"
#include "object_follower.h"
#include "seen_images.h"
#include "tracking/finished_map.h"
#include "tracking/frame_registrar.h"
#include "tracking/map_snapshot.h"

namespace mono_pose_tracker {

// Where an image is expected, and the keyframe whose landmarks are to be looked for.
struct Prediction {
  KeyframeId reference = -1;
  Rigid3 camera_from_map;
};

// A pose found by descriptors alone, until a second view agrees.
struct Tentative {
  std::uint32_t map_id = 0;
  std::int64_t index = 0;
  std::int64_t stamp_ns = 0;
  KeyframeId reference = -1;
  Rigid3 camera_from_reference;
  LandmarkPixels landmarks = nullptr;  // that it was found by
};

// It was loaded: what earlier runs have seen is never dropped for being young.
inline bool has_earlier_frames(const TrackingMap& map) {
  return is_of_earlier_run(map.keyframes.begin()->second.frame_index);
}

// The states of a Tracker, and the one way that an image goes through them. In ten files:
// tracker_states.cpp and tracker_accept.cpp follow the camera, tracker_corrections.cpp the mapper's
// corrections, tracker_object.cpp keeps to the body that turns, tracker_search.cpp is for when the camera is
// lost, tracker_finish.cpp for the end of a recording, tracker_gaps.cpp and tracker_registration.cpp for the
// images that have no pose then, tracker_background.cpp for what stood still, tracker_saved_maps.cpp for maps
// of other runs.
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
        worker_(options_.mapper(camera.focal()), camera, mapping == Mapping::kThreaded,
                std::move(before_mapping)) {}
  ~Impl() { cancel(); }

  void cancel() { cancelled_ = true; }
  FrameReport process(std::int64_t stamp_ns, const PreparedImage& image, const cv::Mat& mask);
  void pass_over() { ++next_index_; }
  void wait();
  void reset();
  void set_options(const TrackerOptions& options);
  void set_load_level(int level);
  std::uint32_t epoch() const { return epoch_; }
  std::optional<SavedMaps> copy_maps();
  void load_maps(SavedMaps saved);
  void restart();
  std::vector<RegisteredFrame> trajectory() const;
  KeyframeId reference_of(std::int64_t frame_index, const TrackingMap& map) const;
  bool finish();
  FrameReport keep_for_later(std::int64_t frame_index, std::int64_t stamp_ns, const PreparedImage& image,
                             const cv::Mat& mask);
  void fill_gaps();
  std::vector<FinishedMap> maps();
  void assess_maps(std::int64_t images, std::vector<FinishedMap>* maps);
  std::set<std::int64_t> adjust_frames(const TrackingMap& map);
  std::set<std::int64_t> refine_with_graph();
  ViewGraph& view_graph() { return worker_.mapper().view_graph(); }
  FinishedMap finished(const TrackingMap& view);
  bool is_consistent_whole(const FinishedMap& map) const;
  void assess_map(std::size_t place, std::int64_t images, FinishedMap* map);
  std::vector<RegisteredImage> seen_in(const FinishedMap& map) const;
  void assess_independent_motion(bool camera_goes_through, FinishedMap* map) const;
  bool may_have_background();
  bool goes_through(const Map& map) const;
  void choose_masks(const Frame& frame, const TrackingMap& map, const Rigid3& camera_from_map);
  bool shows_background(const TrackingMap& view, const Map& map, const MatchesInTime& in_time) const;
  bool looks_for_background() const {
    return options_.segmentation.is_automatic() && !options_.localize_only;
  }
  void expect_object() { expects_object_ = true; }
  ImageFeaturesPtr features_of(const PreparedImage& image);
  StaticBackground background_of(const std::vector<SeenImage>& images) const;
  FrameReport register_image_again(std::int64_t frame_index, std::int64_t stamp_ns,
                                   const PreparedImage& image, const cv::Mat& mask);

  const FrameMaker& frame_maker() const { return frame_maker_; }

  MappingWorker& worker() { return worker_; }
  const MappingWorker& worker() const { return worker_; }
  bool rests_on_two_views() const { return rests_on_two_views_; }

 private:
  // Keyframes on which a pose may ride: about that of the frame that was tracked last, or all.
  enum class Among { kNear, kAll };

  void apply_options();
  void begin_anew();
  // The body that turns is asked for, and what the images show is needed in the end to find it.
  bool keeps_seen() const {
    return pace_ == SearchPace::kRecording && options_.segmentation.wants_turning_object();
  }
  std::optional<Frame> make_frame(std::int64_t index, std::int64_t stamp_ns, const PreparedImage& image,
                                  const Segmentation& segmentation, FrameReport* report);
  void bootstrap(const Frame& frame, FrameReport* report);
  void track(const Frame& frame, FrameReport* report);
  void lose(const Frame& frame, const Frame& of_object, FrameReport* report);
  RegistrationReport follow(const Frame& frame, const TrackingMap& map) const;
  bool search(const Frame& frame, FrameReport* report);
  void end_loss() { frames_lost_ = 0, seeks_additional_map_ = false; }
  bool confirm(const Frame& frame, TrackingMapPtr* map, RegistrationReport* registration);
  bool switch_to_other_object(const TrackingMap& map, const Frame& frame, FrameReport* report);
  void drop_young_map(FrameReport* report);
  void bootstrap_additional(const Frame& frame, FrameReport* report);
  bool go_back_to(std::uint32_t map_id, bool keep_present);
  void apply_corrections(const TrackingMap& map);
  void follow_mapper();
  void forget_dropped_maps(const TrackingMap& map);
  TrackingMapPtr inactive_view(std::uint32_t map_id) const;
  bool accept(const Frame& frame, const TrackingMap& map, const RegistrationReport& registration,
              FrameReport* report);
  void complete_map();
  void resume_largest();
  std::optional<Frame> make_frame_again(std::int64_t frame_index, std::int64_t stamp_ns,
                                        const PreparedImage& image, const cv::Mat& mask, FrameReport* report);
  bool is_found(const RegistrationReport& registration) const;
  FramePose set_pose(const Frame& frame, const TrackingMap& map, const RegistrationReport& registration,
                     Among among, bool is_final = false);
  std::optional<Prediction> predict_from_neighbor(const Frame& frame, std::int64_t neighbor) const;
  bool register_in_gap(const Frame& frame, const std::optional<Prediction>& prediction);
  LandmarkPixels landmarks_of(const KeyframeView& keyframe) const;
  LandmarkPixels registered_by(const Frame& frame, const RegistrationReport& registration) const;
  bool fill_gaps_once();
  void fill_its_gaps();
  void pose_anywhere();
  void exclude_registered();
  void fill_gaps_in_other_maps();
  std::vector<std::uint32_t> all_maps();
  void show(std::uint32_t map_id);
  void begin_in_gaps();
  bool track_in_gap(const Frame& frame);
  void drop_young_maps(const std::set<std::uint32_t>& known);
  RegistrationReport register_near_in_time(const Frame& frame, const TrackingMap& map,
                                           std::size_t keyframes) const;
  // An edge of the view graph between an image and a keyframe of the map.
  struct RegistrationEdge {
    KeyframeId keyframe = -1;
    ViewGraph::Pair pair;
    bool image_is_first = false;
  };
  std::vector<RegistrationEdge> edges_to(const Frame& frame, const TrackingMap& map,
                                         const std::vector<KeyframeId>& keyframes);
  std::optional<Rigid3> pose_by_landmarks(const TrackingMap& map, const std::vector<LandmarkPixel>& landmarks,
                                          const Rigid3& initial) const;
  bool agrees_with_graph(const std::vector<RegistrationEdge>& edges, const TrackingMap& map,
                         const Rigid3& camera_from_map);
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
  void begin_in(const Frame& frame, const TrackingMap& map, const RegistrationReport& registration,
                const std::string& text, FrameReport* report);
  void describe(const RegistrationReport& registration, FrameReport* report) const;
  Frame followed(const Frame& frame, FrameReport* report);
  RegistrationReport locate(const Frame& frame, TrackingMapPtr* map, Frame* of_object, FrameReport* report);
  void finish_report(FrameReport* report);
  bool is_of_motion_now() const;
  void start_motion(const BootstrapReport& bootstrap, const Frame& frame,
                    const RegistrationReport& registration);
  bool is_corrected_since(const TrackingMap& map) const;
  void report_corrections(const TrackingMap& map, FrameReport* report);

  std::atomic<bool> cancelled_{false};
  TrackerOptions given_options_;
  const SearchPace pace_;
  int load_level_ = 0;
  TrackerOptions options_;  // what is given means this for the camera's images
  const CameraModel camera_;
  ObjectFinder object_finder_;
  FrameMaker frame_maker_;
  FrameRegistrar registrar_;
  KeyframePolicy keyframe_policy_;
  InnovationGate innovation_gate_;
  BootstrapJob bootstrap_job_;
  MappingWorker worker_;  // last: its thread uses what stands before it

  State state_ = State::kBootstrapping;
  std::uint32_t epoch_ = 0;
  std::int64_t next_index_ = 0;
  std::int64_t frames_excluded_ = 0;  // of them: images that no frame could be made of
  bool rests_on_two_views_ = false;
  bool is_segmented_ = false;            // an image has had a mask, given or found
  bool expects_object_ = false;          // masks are of one that was found by its motion
  std::vector<MapSession> sessions_;     // of the maps that come from a file; empty: none does
  BootstrapReport bootstrap_;            // the last known
  std::uint64_t reported_revision_ = 0;  // of the map whose mapping times were reported last

  // The last posed frame and its movement since the one before.
  KeyframeId reference_ = -1;
  Rigid3 camera_from_reference_;
  std::optional<Rigid3> motion_;  // camera now from camera one frame ago
  int frames_lost_ = 0;
  std::deque<std::int64_t> doubted_;  // frames in a row, as innovation_gate_ counts them, up to the last
  std::set<std::int64_t> withdrawn_;  // frames of a recording whose poses were doubtful, one after the other
  std::optional<ObjectFollower>
      object_follower_;        // live: that the map is to be of; nothing: of whatever it was begun with
  int objects_abandoned_ = 0;  // maps in a row that were dropped, since another body turned more

  std::map<std::uint32_t, FramePoses> frames_;      // by map
  std::map<std::uint32_t, TrackingMapPtr> others_;  // by map: those kept beside the present one
  std::optional<Tentative> tentative_;
  std::uint64_t corrections_ = 0;                           // sequence of the last one applied
  std::map<std::uint32_t, std::uint32_t> times_corrected_;  // by map
  std::map<std::int64_t, Frame> unregistered_;              // of a finished recording
  SeenImages seen_;                                         // of a recording, of the images that were posed
  KnownMatches known_matches_;                              // of the finished map's keyframes
  bool grown_ = false;                                      // the finished map has
  std::pair<std::uint32_t, std::uint64_t> reported_;        // map and correction that the last report knew of
  std::uint32_t present_map_ = 0;                           // id of the one that reference_ is of
  std::uint32_t motion_map_ = 0;                // of what object_finder_ has told by its motion, once it has
  ScaleSource scale_ = ScaleSource::kMapUnits;  // of its lengths, as reference_ knows them
  double length_scale_ = 1;                     // by corrections since the last report
  std::uint32_t searches_ = 0;                  // for a map beside those there are: counts them
  bool seeks_additional_map_ = false;           // the last of them goes on
};

}  // namespace mono_pose_tracker
