// The part of the Mapper that closes loops.

#include <algorithm>
#include <exception>
#include <set>
#include <utility>

#include "keyframe_landmarks.h"
#include "keyframe_places.h"
#include "mapping/mapper.h"
#include "optimization/map_adjustment.h"
#include "sorted_unique.h"
#include "view_linker.h"

namespace mono_pose_tracker {

namespace {

// Landmarks that keyframes of both sides see.
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

}  // namespace

struct Mapper::TiedAdjustment {
  GlobalAdjustment adjustment;
  std::vector<ViewTie> ties;
};

// Live, keyframes that came after `tied_at` are tied to what they look at and share little with, as it is
// when a recording ends: a map that comes back to a place would else bend until then. What does not hold once
// all is adjusted was another place, and all is adjusted without it.
std::shared_ptr<const Mapper::TiedAdjustment> Mapper::tie_and_adjust(const MapperOptions& options,
                                                                     const Map& snapshot, KeyframeId tied_at,
                                                                     bool parts_were_apart) {
  Map tied = snapshot;
  std::vector<ViewTie> ties;
  ViewGraph graph(view_graph_options(options));
  if (options.adjusts_all)
    ties = link_views(options, overlapping_pairs(options.bundle, tied, tied_at), &graph, &tied);
  while (true) {
    auto solved = GlobalAdjustment::solve(options.bundle, snapshot, parts_were_apart || !ties.empty(), &tied);
    if (!solved) return nullptr;
    const std::set<KeyframeId> loose = with_loose_ties(ties, tied, options.mapping.max_reprojection_px);
    if (loose.empty()) return std::make_shared<TiedAdjustment>(TiedAdjustment{std::move(*solved), ties});
    ties.erase(std::remove_if(ties.begin(), ties.end(),
                              [&](const ViewTie& tie) { return loose.count(tie.keyframe) > 0; }),
               ties.end());
    tied = snapshot;
    tie_views(ties, &tied);
  }
}

void Mapper::forget_aside() {
  ++beside_.ticket;
  beside_.closing = beside_.adjusting = false;
  beside_.sought = beside_.tried_at = -1;
  beside_.aside = nullptr;
  beside_.loop_finder.reset();
}

// Whatever becomes of it, nothing else is kept waiting for it; what it throws, the mapper does. What it
// leaves to be done is dropped where the map is another by then.
Aside Mapper::told_of_its_end(Aside work) const {
  return [work = std::move(work),
          ticket = beside_.ticket](const std::function<bool()>& cancelled) -> std::function<void(Mapper&)> {
    std::function<void(Mapper&)> rest;
    std::exception_ptr error;
    try {
      rest = work(cancelled);
    } catch (...) {
      error = std::current_exception();
    }
    return [rest, error, ticket](Mapper& mapper) {
      const bool is_wanted = ticket == mapper.beside_.ticket;
      if (is_wanted) mapper.beside_.closing = mapper.beside_.adjusting = false;
      if (error) std::rethrow_exception(error);
      if (is_wanted) rest(mapper);
    };
  };
}

Aside Mapper::take_aside() { return std::exchange(beside_.aside, nullptr); }

void Mapper::seek_loop() {
  const KeyframeId newest = tracking_map_->keyframes.rbegin()->first;
  // The same keyframe asked twice would be its own second witness.
  if (beside_.closing || std::exchange(beside_.sought, newest) == newest) return;
  const StageTimer timer(stages_, "loop_search");
  const std::optional<LoopConstraint> loop =
      beside_.loop_finder.find(*tracking_map_, places_->index(), newest);
  if (!loop) return;
  if (std::exchange(beside_.adjusting, false)) ++beside_.ticket;  // it would be of what has drifted
  beside_.closing = true;
  beside_.aside = told_of_its_end([loop = *loop, map = tracking_map_,
                                   asked = options_.bundle.cancel](const std::function<bool()>& cancelled) {
    const auto changes = spread_loop(*map, loop, [&] { return cancelled() || (asked && asked()); });
    return [=](Mapper& mapper) { mapper.close_loop(loop, changes); };
  });
}

void Mapper::close_loop(const LoopConstraint& loop, const std::optional<KeyframeChanges>& changes) {
  const Keyframe *from = map_.keyframe(loop.from), *to = map_.keyframe(loop.to);
  if (!changes || !from || !to) return;
  const StageTimer timer(stages_, "loop_close");
  const ClosedLoop closed{from->frame_index, to->frame_index, loop.drift, loop.old_from_new.scale};
  Map before = map_;
  const KeyframeChanges all = extended_to_all(map_, *changes);
  map_.apply(all);
  if (!fuse_loop(loop)) {
    map_ = std::move(before);
    return;
  }
  loops_.push_back(closed);
  post_correction(all);
  adjust_globally(true);
}

// What stands twice becomes one. False when it does not hold once it was adjusted: then the two were not the
// same place.
bool Mapper::fuse_loop(const LoopConstraint& loop) {
  const auto side_of = [&](KeyframeId id) {
    std::vector<KeyframeId> side = neighbors(id, options_.mapping.window_keyframes - 1);
    side.push_back(id);
    return side;
  };
  const std::vector<KeyframeId> old_side = side_of(loop.from), new_side = side_of(loop.to);
  for (const auto& [in_new, in_old] : loop.matches) map_.merge_landmarks(in_new, in_old);
  const int tied = points_between(map_, old_side, new_side);
  fuse_sides(old_side, new_side);
  fuse_sides(new_side, old_side);
  std::vector<KeyframeId> window = old_side;
  window.insert(window.end(), new_side.begin(), new_side.end());
  window = sorted_unique(std::move(window));
  count(adjust_keyframes(options_.window_bundle(), window, held_keyframes(options_.mapping.window_keyframes),
                         options_.mapping.window_landmarks, &map_));
  cull_observations(landmarks_seen_by(map_, window));
  return points_between(map_, old_side, new_side) >= std::max(options_.min_inliers, tied / 2);
}

void Mapper::fuse_sides(const std::vector<KeyframeId>& targets, const std::vector<KeyframeId>& others) {
  for (const KeyframeId target : targets) fuse(target, landmarks_seen_by(map_, others));
}

// A tenth: what that costs all in all is some ten times the last adjustment, whatever the map grows to.
void Mapper::adjust_now_and_then() {
  if (!options_.adjusts_all || beside_.closing || beside_.adjusting) return;
  const auto keyframes = static_cast<int>(map_.keyframes().size());
  const int window = options_.mapping.window_keyframes;
  if (keyframes <= 2 * window) return;  // adjusted as a whole with every keyframe
  const KeyframeId newest = map_.keyframes().rbegin()->first;
  if (newest - beside_.tried_at < std::max(window, keyframes / 10)) return;
  beside_.tried_at = newest;
  adjust_globally(false);
}

void Mapper::adjust_globally(bool parts_were_apart) {
  (parts_were_apart ? beside_.closing : beside_.adjusting) = true;
  beside_.aside = told_of_its_end([snapshot = map_, asked = options_, parts_were_apart,
                                   tied_at = beside_.tied_at](const std::function<bool()>& cancelled) {
    MapperOptions options = asked;
    options.bundle.cancel = [&] { return cancelled() || asked.bundle.is_cancelled(); };
    const auto result = tie_and_adjust(options, snapshot, tied_at, parts_were_apart);
    return [result, newest = snapshot.keyframes().rbegin()->first](Mapper& mapper) {
      if (result) mapper.take_over(*result, newest);
    };
  });
}

// What was merged takes the place of what stayed: it has to be where the adjustment has it by then.
void Mapper::take_over(const TiedAdjustment& result, KeyframeId newest) {
  const KeyframeChanges all = result.adjustment.apply(&map_);
  std::vector<ViewTie> ties;
  for (const ViewTie& tie : result.ties) {
    if (!is_left_out(tie.keyframe, tie.feature)) ties.push_back(tie);
  }
  tie_views(ties, &map_);
  beside_.tied_at = newest;
  cull_observations(map_.landmark_ids());
  post_correction(all);
  if (renew_scale(kUnitChangeTold)) publish();
}

void Mapper::post_correction(const KeyframeChanges& changes) {
  MapCorrection correction;
  correction.of_map = correction.into_map = map_id_;
  correction.scale_of = scales_of(map_, changes);
  scale_covariances([&](KeyframeId id) { return correction.length_scale(id); });
  add_correction(std::move(correction));
  // What awaits a second keyframe is of the map as it was.
  beside_.loop_finder.reset();
  publish();
}

}  // namespace mono_pose_tracker
