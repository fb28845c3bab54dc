#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "map/tracking_map.h"
#include "mapping/atlas.h"
#include "mapping/cross_view_matcher.h"
#include "mapping/global_refiner.h"
#include "mapping/loop_closer.h"
#include "mapping/mapper_input.h"
#include "mapping/track_extender.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/mapper_options.h"

namespace mono_pose_tracker {

class Mapper;

/// Work on a snapshot of the map that runs in the background, as its duration grows with the map. It returns
/// a short job for the mapper, and returns early once `cancelled` is true. It does not throw: the returned
/// job throws its errors, so that the mapper knows that the work has ended.
using BackgroundJob = std::function<std::function<void(Mapper&)>(const std::function<bool()>& cancelled)>;

/// Builds the present map of an atlas (paper, steps 4c and 4d): guided matching with covisible keyframes,
/// triangulation, track extension, windowed bundle adjustment, culling. Only the mapper changes maps; other
/// threads read the TrackingMap that every change publishes. Not shared between threads.
class Mapper {
 public:
  explicit Mapper(const MapperOptions& options) : options_(options), state_(options) {}

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
  BackgroundJob take_background_job() { return std::exchange(background_.job, nullptr); }
  /// Loops closed in any of the maps, in order.
  const std::vector<ClosedLoop>& loops() const { return loops_; }
  void set_options(const MapperOptions& options) {
    options_ = options;
    state_.loop_finder.set_options(options);
  }
  /// Applies a similarity to the present map, published as a correction. scale_source: the new source of its
  /// unit; nothing: unchanged.
  void transform(const Sim3& new_from_map, std::optional<ScaleSource> scale_source);

  /// GlobalRefiner::finish, connect, refine and remove, for the present map.
  void finish();
  void connect() { GlobalRefiner(options_, &atlas_, &view_graph()).connect(); }
  std::set<KeyframeId> refine_with_graph();
  std::set<KeyframeId> remove_wrong(const std::set<KeyframeId>& wrong);
  /// The view graph of the recording, for all maps. It is created at the first call, with the options of that
  /// time.
  ViewGraph& view_graph();

  /// Merges all pairs of maps that the view graph aligns, at the end of a recording.
  void join_rest();
  std::vector<std::uint32_t> inactive_maps() const { return atlas_.inactive_ids(); }
  std::vector<Map> all_maps() const { return atlas_.all_maps(); }

  /// The mapper before a change, to return to where the change throws. The view graph keeps its new edges.
  struct Checkpoint;
  Checkpoint checkpoint();
  void go_back(const Checkpoint& checkpoint);

  /// Number of failed bundle adjustments; each left the map unchanged.
  int failed_adjustments() const { return failed_adjustments_; }

  const Map& map() const { return atlas_.map(); }
  TrackingMapPtr tracking_map() const { return tracking_map_; }

 private:
  // State of the work on the present map, reset when that changes.
  struct State {
    explicit State(const MapperOptions& options) : loop_finder(options) {}

    LoopFinder loop_finder;
    std::size_t asked_at = 0;      // number of keyframes at the last check of the beginning
    KeyframeId sought = -1;        // the last keyframe checked for a loop
    KeyframeId tried_at = -1;      // the newest keyframe at the last global adjustment
    KeyframeId merged_up_to = -1;  // tracks of keyframes up to this one were matched across views
  };

  struct Background {
    bool closing = false;      // a loop is being closed
    bool adjusting = false;    // a global adjustment without a loop is running
    std::uint64_t ticket = 0;  // of the job; jobs of an earlier map have another one
    BackgroundJob job;         // not taken yet
  };

  AtlasMap& present() { return atlas_.present(); }
  TrackExtender extender() { return {options_, present().motions.excluded(), &present().map}; }
  bool is_cancelled() const { return options_.bundle.is_cancelled(); }

  void begin(const InitialMap& initial, std::uint32_t epoch);
  void reset_state();
  void publish();
  void match(KeyframeId id);
  void adjust_window(KeyframeId newest, int waiting);
  void adjust(const std::vector<KeyframeId>& window, int fixed);
  void correct_beginning();
  void cull_young_landmarks(KeyframeId newest);
  void cull_keyframes(KeyframeId newest);
  void cap_keyframes(KeyframeId newest);
  bool renew_unit();
  void scale_by_marker(KeyframeId newest, const std::vector<Eigen::Vector3d>& marker);
  void take_over(const GlobalRefiner& refiner, std::uint64_t corrections_before);

  bool join(std::uint32_t older_id, std::uint32_t newer_id, const MapAlignment& newer_in_older);
  bool join_where_aligned(KeyframeId newest);
  bool join_any(std::set<std::pair<std::uint32_t, std::uint32_t>>* apart);
  std::optional<MapAlignment> find_alignment(const AtlasMap& other, KeyframeId keyframe) const;

  void drop_background_job();
  BackgroundJob with_completion(BackgroundJob work) const;
  void close_loop(const LoopConstraint& loop, const std::optional<KeyframeChanges>& changes);
  bool fuse_loop(const LoopConstraint& loop);
  void adjust_globally(bool parts_were_apart);
  void take_over(const GlobalAdjustment& adjustment, const std::vector<SharedTrack>& tracks,
                 KeyframeId newest);
  void publish_correction(const KeyframeChanges& changes);

  MapperOptions options_;
  Atlas atlas_;
  State state_;
  Background background_;
  std::uint32_t epoch_ = 0;
  std::uint64_t revision_ = 0;
  std::optional<ViewGraph> view_graph_;
  std::vector<ClosedLoop> loops_;
  int failed_adjustments_ = 0;  // since construction
  StageTimes stages_;           // of the current change
  TrackingMapPtr tracking_map_;
};

struct Mapper::Checkpoint {
  Atlas::Checkpoint atlas;
  State state;
  std::uint32_t epoch = 0;
  std::size_t loops = 0;
  TrackingMapPtr tracking_map;
};

}  // namespace mono_pose_tracker
