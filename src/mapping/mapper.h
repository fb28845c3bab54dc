#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "map/tracking_map.h"
#include "mapping/background_job.h"
#include "mapping/cross_view_matcher.h"
#include "mapping/graph_consistency.h"
#include "mapping/initial_map.h"
#include "mapping/keyframe_candidate.h"
#include "mapping/larger_object_watch.h"
#include "mapping/loop_closer.h"
#include "mapping/loop_finder.h"
#include "mapping/map_joiner.h"
#include "mapping/matches_in_time.h"
#include "mapping/object_watch.h"
#include "mapping/rigidity_watch.h"
#include "mapping/static_background_watch.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

class KeyframePlaces;

/// Builds the map (paper, steps 4c and 4d): guided matching against the keyframes that share view,
/// triangulation, longer tracks, windowed bundle adjustment, culling. The only one to change the map: what
/// others read is the TrackingMap that every change ends with. Not shared between threads.
class Mapper {
 public:
  Mapper(const MapperOptions& options, const CameraModel& camera)
      : options_(options), camera_(camera), map_state_(options, camera) {}

  /// Begins a map, in place of all that there are. Its scale: what ScaleOptions say, else the median depth of
  /// the first view's points is 1.
  void initialize(const InitialMap& initial, std::uint32_t epoch);
  /// Begins a map beside those that there are: they are kept, and joined with it when the two meet. Beside a
  /// capped map no more keyframes are kept than it may hold: the smallest map goes first.
  void begin_additional(const InitialMap& initial, std::uint32_t epoch);
  /// Goes back to a map that is kept. The present one is kept in its place, or dropped. False when there is
  /// none of this id, any more: the present one goes on, in the new epoch.
  bool resume(std::uint32_t map_id, bool keep_present, std::uint32_t epoch);
  /// Goes on in a map that was saved, in place of all that there are.
  void restore(Map map, std::uint32_t epoch);
  /// The same beside those that there are: they are kept.
  void restore_additional(Map map, std::uint32_t epoch);
  /// waiting: keyframes that wait behind this one. The bundle adjustment's window is divided among them, and
  /// with two or more it is left to the next; the map is consistent all the same.
  void insert(const KeyframeCandidate& candidate, int waiting = 0);
  /// Looks whether the newest keyframe shows an old place again, unless that was asked before. A loop is
  /// closed aside: its drift is spread over the map (a correction), then all of it is adjusted (another).
  void seek_loop();
  /// Adjusts all of the map aside when it has grown by a tenth since that was done last: windows that were
  /// adjusted one after the other have drifted against each other. What comes of it is a correction.
  void adjust_now_and_then();
  /// What is to be done beside the mapper's own work now; null: nothing.
  BackgroundJob take_background_job();
  /// Those closed in any of the maps, in order.
  const std::vector<ClosedLoop>& loops() const { return loops_; }
  void set_options(const MapperOptions& options) {
    options_ = options;
    map_state_.loop_finder.set_options(options);
  }
  /// Moves the present map as a whole: a correction. scale_source: what its unit rests on from now on;
  /// nothing where that stays.
  void transform(const Sim3& new_from_map, std::optional<ScaleSource> scale_source);

  /// Last optimisation of a recording: tracks are completed between all keyframes that share view, and
  /// everything is bundle-adjusted.
  void finish();

  /// The recording's, of all maps. Made at the first call, with the options of that time.
  ViewGraph& view_graph();
  /// Adds the edges of this map to the view graph: keyframes before in time, covisible ones, those that look
  /// like each other, and pairs that overlap.
  void connect(const KeyframePairs& overlapping = {});
  /// The global refinement against the view graph: segments that it puts elsewhere are moved there and the
  /// map is finished anew, until none is left or max_rounds. Keyframes that it contradicts without another
  /// place for them are removed; they are returned.
  std::set<KeyframeId> refine_with_graph(const GraphConsistencyOptions& consistency);

  /// Takes out keyframes whose poses are wrong, and what they alone saw; the first two, by which the
  /// map has its frame, stay.
  void remove_keyframes(const std::set<KeyframeId>& ids);

  /// For the end of a recording: joins each two maps that the view graph aligns.
  void join_rest();
  /// Ids of the maps that are kept beside the present one.
  std::vector<std::uint32_t> inactive_maps() const;
  /// Copies of all maps, the present one among them, the oldest first.
  std::vector<Map> all_maps() const;

  /// Bundle adjustments that failed, each of which left the map as it was.
  int failed_adjustments() const { return failed_adjustments_; }

  const Map& map() const { return map_; }
  TrackingMapPtr tracking_map() const { return tracking_map_; }

 private:
  bool is_cancelled() const { return options_.bundle.is_cancelled(); }

  // Of a length: who measures with the map should know of it, and a smaller change is not worth telling.
  static constexpr double kReportedUnitChange = 0.01;
  // Whatever the options let an adjustment between images take: where a recording ends no image waits.
  static constexpr int kFinalIterations = 50;
  static constexpr double kFinalTolerance = 1e-7;  // share of the cost: the adjustment that gives the result

  // What gave a map its unit, to be asked again.
  struct UnitSource {
    // Bearings of the corners of the marker in keyframes that saw it while the map had no scale.
    std::map<KeyframeId, std::vector<Eigen::Vector3d>> markers;
    std::optional<std::pair<KeyframeId, KeyframeId>> baseline;  // the two whose distance is known
  };

  // What is known of the present map beside it. Another's is not known: it is begun anew.
  struct MapState {
    MapState(const MapperOptions& options, const CameraModel& camera) : loop_finder(options, camera) {}

    // Of images that something was left out of before they came here, all of it.
    std::map<KeyframeId, ImageFeaturesPtr> unmasked;
    std::map<KeyframeId, std::vector<char>> excluded;  // features of another motion, where there are some
    RigidityWatch watch;
    LargerObjectWatch larger_object_watch;
    ObjectWatch object_watch;
    StaticBackgroundWatch static_background_watch;
    LoopFinder loop_finder;
    std::size_t asked_at = 0;      // keyframes that there were when the beginning was doubted last
    KeyframeId sought = -1;        // the last keyframe that a loop was sought of
    KeyframeId tried_at = -1;      // the newest keyframe when all was to be adjusted last
    KeyframeId merged_up_to = -1;  // up to this one keyframes are tied to what they look at
    bool closing = false;          // a loop is
    bool adjusting = false;        // all is, with nothing to be closed
    std::uint64_t ticket = 0;      // of what is done aside: that of an earlier map has another
    BackgroundJob background_job;  // that nobody has taken yet
  };

  // A map that is not tracked in at present.
  struct InactiveMap {
    Map map;
    std::shared_ptr<KeyframePlaces> places;
    KeyframeCovariances covariances;
    UnitSource unit;
  };

  // Keyframes that look like one, by its id.
  using SimilarKeyframes = std::map<KeyframeId, std::vector<KeyframeId>>;

  // Keyframes that are held while so many move, those that see most of the same: as a rule all that share
  // much with the window, and a limit to what its adjustment costs, however large the map grows.
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
  struct MergedAdjustment;  // of all of a snapshot, with what was tied before
  static std::shared_ptr<const MergedAdjustment> merge_and_adjust(const MapperOptions& options,
                                                                  const Map& snapshot,
                                                                  KeyframeId merged_up_to,
                                                                  bool parts_were_apart);
  void take_over(const MergedAdjustment& result, KeyframeId newest);
  void adjust_globally(bool parts_were_apart);
  void complete(BundleOptions bundle);
  void count(const BundleReport& report) { failed_adjustments_ += report.failed; }
  void post_correction(const KeyframeChanges& changes);
  void add_correction(MapCorrection correction);
  void forget_old_corrections();
  void match(KeyframeId id);
  void separate_motions(KeyframeId id);
  bool adjust_after_merging(const BundleOptions& bundle);
  BundleOptions final_bundle() const;
  void restore_if_better(Map as_it_was, const GraphConsistencyOptions& consistency);
  void retriangulate(const GraphConsistencyOptions& consistency);
  void drop_two_view_landmarks();
  void exclude_static_overlay(KeyframeId id);
  void watch_static_background(const InitialMap& initial);
  void watch_static_background(const KeyframeCandidate& candidate);
  void report_doubt(TrackingMap* view) const;
  void watch_map_object();
  void watch_object(KeyframeId before_id, KeyframeId newest_id, const PairMotions& pair);
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
  Map map_;
  MapState map_state_;
  UnitSource unit_;
  // Of keyframes where the last adjustment left them, in the map (TrackingMap::covariances).
  KeyframeCovariances covariances_;
  std::uint32_t epoch_ = 0;
  std::uint64_t revision_ = 0;
  std::uint32_t map_id_ = 0;                       // the epoch that it began in, and 1
  std::map<std::uint32_t, InactiveMap> inactive_;  // by id
  MapCorrections corrections_;
  std::uint64_t last_correction_ = 0;  // its sequence
  std::shared_ptr<KeyframePlaces> places_;
  std::optional<ViewGraph> view_graph_;
  std::vector<ClosedLoop> loops_;
  int failed_adjustments_ = 0;  // since it was made
  StageTimes stages_;           // of the change under way
  TrackingMapPtr tracking_map_;
};

}  // namespace mono_pose_tracker
