// The part of the Mapper that closes loops.

#include <algorithm>
#include <exception>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "cross_view_matcher.h"
#include "keyframe_landmarks.h"
#include "mapping/mapper.h"

namespace mono_pose_tracker {

namespace {

// Number of landmarks observed from both sides.
int points_between(const Map& map, const std::vector<KeyframeId>& old_side,
                   const std::vector<KeyframeId>& new_side) {
  const std::set<KeyframeId> in_old(old_side.begin(), old_side.end()),
      in_new(new_side.begin(), new_side.end());
  int count = 0;
  for (const auto& entry : map.landmarks()) {
    const std::vector<Observation>& seen = entry.second.observations;
    const auto by = [&](const std::set<KeyframeId>& side) {
      return std::any_of(seen.begin(), seen.end(),
                         [&](const Observation& o) { return side.count(o.keyframe) > 0; });
    };
    count += by(in_old) && by(in_new);
  }
  return count;
}

struct MergedAdjustment {
  GlobalAdjustment adjustment;
  std::vector<SharedTrack> tracks;
};

// Global adjustment of a snapshot. Live, matches keyframes newer than `merged_up_to` across views with few
// common landmarks, as at the end of a recording: otherwise a map that returns to a place stays bent until
// then. Tracks that are inconsistent after the adjustment are of another place, and the adjustment is
// repeated without them.
std::shared_ptr<const MergedAdjustment> merge_and_adjust(const MapperOptions& options, const Map& snapshot,
                                                         KeyframeId merged_up_to, bool parts_were_apart) {
  Map merged = snapshot;
  std::vector<SharedTrack> tracks;
  ViewGraph graph(view_graph_options(options));
  if (options.is_live)
    tracks =
        match_across_views(options, overlapping_pairs(options.bundle, merged, merged_up_to), &graph, &merged);
  while (true) {
    auto solved =
        GlobalAdjustment::solve(options.bundle, snapshot, parts_were_apart || !tracks.empty(), &merged);
    if (!solved) return nullptr;
    const std::set<KeyframeId> loose =
        with_inconsistent_tracks(tracks, merged, options.mapping.max_reprojection_px);
    if (loose.empty())
      return std::make_shared<MergedAdjustment>(MergedAdjustment{std::move(*solved), tracks});
    tracks.erase(std::remove_if(tracks.begin(), tracks.end(),
                                [&](const SharedTrack& track) { return loose.count(track.keyframe) > 0; }),
                 tracks.end());
    merged = snapshot;
    merge_tracks(tracks, &merged);
  }
}

}  // namespace

void Mapper::drop_background_job() {
  background_ = {false, false, background_.ticket + 1, nullptr};
  state_.sought = state_.tried_at = -1;
  state_.loop_finder.reset();
}

// Wraps background work so that the mapper always learns of its end and throws its errors. Its result is
// dropped when the map has changed by then.
BackgroundJob Mapper::with_completion(BackgroundJob work) const {
  return [work = std::move(work), ticket = background_.ticket](
             const std::function<bool()>& cancelled) -> std::function<void(Mapper&)> {
    std::function<void(Mapper&)> rest;
    std::exception_ptr error;
    try {
      rest = work(cancelled);
    } catch (...) {
      error = std::current_exception();
    }
    return [rest, error, ticket](Mapper& mapper) {
      const bool is_wanted = ticket == mapper.background_.ticket;
      if (is_wanted) mapper.background_.closing = mapper.background_.adjusting = false;
      if (error) std::rethrow_exception(error);
      if (is_wanted) rest(mapper);
    };
  };
}

void Mapper::seek_loop() {
  const KeyframeId newest = tracking_map_->keyframes.rbegin()->first;
  // Tested twice, a keyframe would confirm itself.
  if (background_.closing || std::exchange(state_.sought, newest) == newest) return;
  const StageTimer timer(stages_, "loop_search");
  const std::optional<LoopConstraint> loop =
      state_.loop_finder.find(map(), present().places->index(), newest);
  if (!loop) return;
  if (std::exchange(background_.adjusting, false)) ++background_.ticket;  // it would be of the drifted map
  background_.closing = true;
  background_.job = with_completion([loop = *loop, map = tracking_map_,
                                     asked = options_.bundle.cancel](const std::function<bool()>& cancelled) {
    const auto changes =
        distribute_loop_correction(*map, loop, [&] { return cancelled() || (asked && asked()); });
    return [=](Mapper& mapper) { mapper.close_loop(loop, changes); };
  });
}

void Mapper::close_loop(const LoopConstraint& loop, const std::optional<KeyframeChanges>& changes) {
  Map& map = present().map;
  const Keyframe *from = map.keyframe(loop.from), *to = map.keyframe(loop.to);
  if (!changes || !from || !to) return;
  const StageTimer timer(stages_, "loop_close");
  const ClosedLoop closed{from->frame_index, to->frame_index, loop.drift, loop.old_from_new.scale};
  Map before = map;
  const KeyframeChanges all = extended_to_all(map, *changes);
  map.apply(all);
  if (!fuse_loop(loop)) {
    map = std::move(before);
    return;
  }
  loops_.push_back(closed);
  publish_correction(all);
  adjust_globally(true);
}

// Merges the duplicated landmarks of a loop. Returns false when the loop is inconsistent after the
// adjustment: the two were different places.
bool Mapper::fuse_loop(const LoopConstraint& loop) {
  Map& map = present().map;
  const auto side_of = [&](KeyframeId id) {
    std::vector<KeyframeId> side = neighbors(map, id, options_.mapping.window_keyframes - 1);
    side.push_back(id);
    return side;
  };
  const std::vector<KeyframeId> old_side = side_of(loop.from), new_side = side_of(loop.to);
  for (const auto& [in_new, in_old] : loop.matches) map.merge_landmarks(in_new, in_old);
  const int merged = points_between(map, old_side, new_side);
  for (const KeyframeId target : old_side) extender().extend(target, landmarks_observed_by(map, new_side));
  for (const KeyframeId target : new_side) extender().extend(target, landmarks_observed_by(map, old_side));
  std::vector<KeyframeId> window = old_side;
  window.insert(window.end(), new_side.begin(), new_side.end());
  window = sorted_unique(std::move(window));
  adjust(window, held_keyframes(options_.mapping.window_keyframes));
  extender().cull(landmarks_observed_by(map, window));
  return points_between(map, old_side, new_side) >= std::max(options_.min_inliers, merged / 2);
}

// At each tenth of growth: the total cost is then about ten times that of the last adjustment, for any map
// size.
void Mapper::adjust_now_and_then() {
  if (!options_.is_live || background_.closing || background_.adjusting) return;
  const auto keyframes = static_cast<int>(map().keyframes().size());
  const int window = options_.mapping.window_keyframes;
  if (keyframes <= 2 * window) return;  // adjusted completely with every keyframe
  const KeyframeId newest = map().keyframes().rbegin()->first;
  if (newest - state_.tried_at < std::max(window, keyframes / 10)) return;
  state_.tried_at = newest;
  adjust_globally(false);
}

void Mapper::adjust_globally(bool parts_were_apart) {
  background_.job =
      with_completion([snapshot = map(), asked = options_, parts_were_apart,
                       merged_up_to = state_.merged_up_to](const std::function<bool()>& cancelled) {
        MapperOptions options = asked;
        options.bundle.cancel = [&] { return cancelled() || asked.bundle.is_cancelled(); };
        const auto result = merge_and_adjust(options, snapshot, merged_up_to, parts_were_apart);
        return [result, newest = snapshot.keyframes().rbegin()->first](Mapper& mapper) {
          if (result) mapper.take_over(result->adjustment, result->tracks, newest);
        };
      });
  (parts_were_apart ? background_.closing : background_.adjusting) = true;
}

// Applies a finished adjustment; then merges the tracks again in the present map, at their adjusted
// positions.
void Mapper::take_over(const GlobalAdjustment& adjustment, const std::vector<SharedTrack>& tracks,
                       KeyframeId newest) {
  Map& map = present().map;
  const KeyframeChanges all = adjustment.apply(&map);
  std::vector<SharedTrack> kept;
  for (const SharedTrack& track : tracks) {
    if (!is_flagged(present().motions.excluded(), track.keyframe, track.feature)) kept.push_back(track);
  }
  merge_tracks(kept, &map);
  state_.merged_up_to = newest;
  extender().cull(map.landmark_ids());
  publish_correction(all);
  if (renew_unit()) publish();
}

void Mapper::publish_correction(const KeyframeChanges& changes) {
  atlas_.add_correction(changes);
  // A loop that awaits a second keyframe refers to the map before the correction.
  state_.loop_finder.reset();
  publish();
}

}  // namespace mono_pose_tracker
