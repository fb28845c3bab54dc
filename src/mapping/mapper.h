#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "map/tracking_map.h"
#include "mapping/cross_view_matcher.h"
#include "mapping/graph_consistency.h"
#include "mapping/initial_map.h"
#include "mapping/keyframe_candidate.h"
#include "mapping/loop_closer.h"
#include "mapping/loop_finder.h"
#include "mapping/map_joiner.h"
#include "mapping/mapper_limits.h"
#include "mapping/motion_watch.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

class KeyframePlaces;
class Mapper;

/// Work on a snapshot of the map that runs in the background, as its duration grows with the map. It returns
/// a short job for the mapper, and returns early once `cancelled` is true. It does not throw: the returned
/// job throws its errors, so that the mapper knows that the work has ended.
using BackgroundJob = std::function<std::function<void(Mapper&)>(const std::function<bool()>& cancelled)>;

/// Builds the map (paper, steps 4c and 4d): guided matching with covisible keyframes, triangulation, track
/// extension, windowed bundle adjustment, culling. Only the mapper changes the map; other threads read the
/// TrackingMap that every change publishes. Not shared between threads.
class Mapper {
 public:
  Mapper(const MapperOptions& options, const CameraModel& camera, const MapperLimits& limits = {})
      : options_(options), camera_(camera), limits_(limits), map_state_(options, camera, limits.loops) {}

  /// Begins a map and drops all others. Its scale follows ScaleOptions; otherwise the median distance of
  /// the first view's points is 1.
  void initialize(const InitialMap& initial, std::uint32_t epoch);
  /// Begins a map in addition to the existing ones, which become inactive and are merged with it once they
  /// can be aligned. With a keyframe cap, inactive maps hold no more keyframes than it allows: the smallest
  /// map is dropped first.
  void begin_additional(const InitialMap& initial, std::uint32_t epoch);
  /// Switches to an inactive map. The present map becomes inactive, or is dropped. Returns false when there
  /// is no map with this id any more: the present one continues in the new epoch.
  bool resume(std::uint32_t map_id, bool keep_present, std::uint32_t epoch);
  /// Continues in a saved map and drops all others.
  void restore(Map map, std::uint32_t epoch);
  /// The same, but the existing maps become inactive.
  void restore_additional(Map map, std::uint32_t epoch);
  /// Inserts a keyframe. waiting: number of keyframes that wait behind this one. The window of the bundle
  /// adjustment is divided among them; with two or more, the adjustment is left to the next. The map stays
  /// consistent.
  void insert(const KeyframeCandidate& candidate, int waiting = 0);
  /// Checks once whether the newest keyframe closes a loop. The loop is closed in the background: its
  /// correction is distributed over the map, then the whole map is adjusted. Each is published as a
  /// correction.
  void seek_loop();
  /// Adjusts the whole map in the background when it has grown by a tenth since the last time, as consecutive
  /// windows drift against each other. The result is published as a correction.
  void adjust_now_and_then();
  /// The background job to be run now; null: none.
  BackgroundJob take_background_job();
  /// Loops closed in any of the maps, in order.
  const std::vector<ClosedLoop>& loops() const { return loops_; }
  void set_options(const MapperOptions& options) {
    options_ = options;
    map_state_.loop_finder.set_options(options);
  }
  /// Applies a similarity to the present map, published as a correction. scale_source: the new source of its
  /// unit; nothing: unchanged.
  void transform(const Sim3& new_from_map, std::optional<ScaleSource> scale_source);

  /// Final optimisation of a recording: connects the view graph, merges tracks by its matches, replaces the
  /// landmarks by its tracks, completes these between covisible keyframes, and runs global bundle
  /// adjustments.
  void finish();

  /// The view graph of the recording, for all maps. It is created at the first call, with the options of that
  /// time.
  ViewGraph& view_graph();
  /// Adds the edges of this map to the view graph: to earlier keyframes, covisible ones, similar ones, and
  /// overlapping pairs.
  void connect(const KeyframePairs& overlapping = {});
  /// Global refinement of a finished map against the view graph, in a few rounds. Each moves
  /// inconsistent segments to where the graph places them and finishes the map again, or removes them.
  /// Returns the removed keyframes.
  std::set<KeyframeId> refine_with_graph(const GraphConsistencyOptions& consistency);

  /// Removes keyframes with wrong poses, and landmarks that only they observe. The first two keyframes stay,
  /// as they define the map's frame.
  void remove_keyframes(const std::set<KeyframeId>& ids);

  /// Merges all pairs of maps that the view graph aligns, at the end of a recording.
  void join_rest();
  /// Ids of the inactive maps.
  std::vector<std::uint32_t> inactive_maps() const;
  /// Copies of all maps including the present one, the oldest first.
  std::vector<Map> all_maps() const;

  /// Number of failed bundle adjustments; each left the map unchanged.
  int failed_adjustments() const { return failed_adjustments_; }

  const Map& map() const { return map_; }
  TrackingMapPtr tracking_map() const { return tracking_map_; }

 private:
  bool is_cancelled() const { return options_.bundle.is_cancelled(); }

  // The source of a map's unit, to be evaluated again.
  struct UnitSource {
    // Bearings of the marker's corners in keyframes that observed it before the map had a scale.
    std::map<KeyframeId, std::vector<Eigen::Vector3d>> markers;
    std::optional<std::pair<KeyframeId, KeyframeId>> baseline;  // the two keyframes at a known distance
  };

  // State of the present map besides its content. It is reset when the present map changes.
  struct MapState {
    MapState(const MapperOptions& options, const CameraModel& camera, const LoopOptions& loops)
        : watch(motion_segmentation_options(options.matching, options.ransac, 1)),
          loop_finder(options, camera, loops) {}

    // Unmasked features of keyframes that were inserted with masked ones.
    std::map<KeyframeId, ImageFeaturesPtr> unmasked;
    std::map<KeyframeId, std::vector<char>> excluded;  // flags of features with another motion
    MotionWatch watch;
    LoopFinder loop_finder;
    std::size_t asked_at = 0;      // number of keyframes at the last check of the beginning
    KeyframeId sought = -1;        // the last keyframe checked for a loop
    KeyframeId tried_at = -1;      // the newest keyframe at the last global adjustment
    KeyframeId merged_up_to = -1;  // tracks of keyframes up to this one were matched across views
    bool closing = false;          // a loop is being closed
    bool adjusting = false;        // a global adjustment without a loop is running
    std::uint64_t ticket = 0;      // of the background job; jobs of an earlier map have another one
    BackgroundJob background_job;  // not taken yet
  };

  // A map in which the camera is not tracked at present.
  struct InactiveMap {
    Map map;
    std::shared_ptr<KeyframePlaces> places;
    KeyframeCovariances covariances;
    UnitSource unit;
  };

  // Similar keyframes of a keyframe, by its id.
  using SimilarKeyframes = std::map<KeyframeId, std::vector<KeyframeId>>;

  // Number of fixed keyframes for a window of this size: those that share most landmarks with it. They
  // include nearly all covisible keyframes and bound the cost of the adjustment in a large map.
  static int held_keyframes(int window) { return 3 * window; }
  std::vector<KeyframeId> neighbors(KeyframeId id, int count) const;
  void begin(const InitialMap& initial, std::uint32_t epoch);
  void keep_present();
  void cap_inactive_maps();
  bool join_where_aligned(KeyframeId newest);
  bool join(std::uint32_t inactive_id, const MapAlignment& alignment);
  bool join_any(std::set<std::pair<std::uint32_t, std::uint32_t>>* apart);
  bool join_anywhere(std::uint32_t inactive_id);
  void become_part_of(std::uint32_t inactive_id, const MergedIds& added, double scale,
                      ScaleSource own_source);
  bool join_newer(std::uint32_t inactive_id, const MapAlignment& alignment);
  std::optional<MapAlignment> find_alignment(const InactiveMap& other, KeyframeId keyframe) const;
  void adjust_boundary(const std::vector<KeyframeId>& boundary);
  bool bring_up_to_date(KeyframeCandidate* candidate) const;
  void reset_map_state();
  void drop_background_job();
  BackgroundJob with_completion(BackgroundJob work) const;
  void close_loop(const LoopConstraint& loop, const std::optional<KeyframeChanges>& changes);
  bool fuse_loop(const LoopConstraint& loop);
  void fuse_sides(const std::vector<KeyframeId>& targets, const std::vector<KeyframeId>& others);
  struct MergedAdjustment;  // global adjustment of a snapshot after merging tracks
  static std::shared_ptr<const MergedAdjustment> merge_and_adjust(const MapperOptions& options,
                                                                  const MapperLimits& limits,
                                                                  const Map& snapshot,
                                                                  KeyframeId merged_up_to,
                                                                  bool parts_were_apart);
  void take_over(const MergedAdjustment& result, KeyframeId newest);
  void adjust_globally(bool parts_were_apart);
  void complete(SimilarKeyframes* similar);
  void settle();
  bool correct_segments(const std::vector<InconsistentSegment>& segments,
                        const GraphConsistencyOptions& consistency, std::set<KeyframeId>* removed);
  void remove_wrong(const std::set<KeyframeId>& wrong, std::set<KeyframeId>* removed);
  void count(const BundleReport& report) { failed_adjustments_ += report.failed; }
  void post_correction(const KeyframeChanges& changes);
  void add_correction(MapCorrection correction);
  void forget_old_corrections();
  void match(KeyframeId id);
  void separate_motions(KeyframeId id);
  void adjust_roughly(const BundleOptions& bundle);
  void adjust_after_merging();
  BundleOptions final_bundle() const;
  void restore_if_better(Map as_it_was, const GraphConsistencyOptions& consistency);
  void retriangulate(const GraphConsistencyOptions& consistency);
  void drop_two_view_landmarks();
  void exclude_static_overlay();
  void exclude_static_overlay(KeyframeId id);
  void watch_static_background(const InitialMap& initial);
  void watch_static_background(const KeyframeCandidate& candidate);
  void report_doubt(TrackingMap* view) const;
  void watch_map_object();
  void watch_pair(KeyframeId before_id, KeyframeId newest_id, const PairMotions* known);
  MotionSegmentationOptions motion_options() const;
  void exclude(KeyframeId id, const std::vector<char>& features);
  bool is_excluded(KeyframeId id, int feature) const;
  void create_landmarks(KeyframeId newest, const std::vector<KeyframeId>& neighbors);
  std::optional<std::vector<LandmarkId>> within_reach(KeyframeId id, SimilarKeyframes* known) const;
  void fuse(KeyframeId target, const std::optional<std::vector<LandmarkId>>& landmarks);
  void adjust_window(KeyframeId newest, int waiting);
  void update_covariances(const std::vector<KeyframeId>& window);
  void find_covariances();
  void scale_covariances(const std::function<double(KeyframeId)>& scale_of);
  void cull_observations(const std::vector<LandmarkId>& landmarks);
  void cull_young_landmarks(KeyframeId newest);
  void cull_keyframes(KeyframeId newest);
  void cap_keyframes(KeyframeId newest);
  void remove_keyframe(KeyframeId id);
  void rescale(double factor);
  void set_scale(const InitialMap& initial, const std::vector<KeyframeId>& ids);
  void correct_beginning();
  void report_corrected_beginning();
  void move_map(const Sim3& new_from_map);
  std::optional<double> metres_by_marker() const;
  std::optional<double> metres_by_baseline() const;
  bool renew_scale(double least_change);
  void scale_by_marker(KeyframeId newest, const std::vector<Eigen::Vector3d>& marker);
  void publish();

  MapperOptions options_;
  CameraModel camera_;
  MapperLimits limits_;
  Map map_;
  MapState map_state_;
  UnitSource unit_;
  // Covariances of keyframes after their last adjustment, in the map (TrackingMap::covariances).
  KeyframeCovariances covariances_;
  std::uint32_t epoch_ = 0;
  std::uint64_t revision_ = 0;
  std::uint32_t map_id_ = 0;                       // the epoch in which it began, plus 1
  std::map<std::uint32_t, InactiveMap> inactive_;  // by id
  MapCorrections corrections_;
  std::uint64_t last_correction_ = 0;  // its sequence
  std::shared_ptr<KeyframePlaces> places_;
  std::optional<ViewGraph> view_graph_;
  std::vector<ClosedLoop> loops_;
  int failed_adjustments_ = 0;  // since construction
  StageTimes stages_;           // of the current change
  TrackingMapPtr tracking_map_;
};

}  // namespace mono_pose_tracker
