// The part of the Mapper that closes loops.

#include <algorithm>
#include <exception>
#include <set>
#include <utility>

#include "keyframe_landmarks.h"
#include "keyframe_places.h"
#include "mono_pose_tracker/mapping/mapper.h"
#include "mono_pose_tracker/optimization/map_adjustment.h"
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

void Mapper::forget_aside() {
  ++beside_.ticket;
  beside_.closing = beside_.adjusting = false;
  beside_.sought = beside_.adjusted_at = -1;
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
  adjust_globally(true, beside_.adjusted_at);
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
  if (newest - beside_.adjusted_at < std::max(window, keyframes / 10)) return;
  adjust_globally(false, std::exchange(beside_.adjusted_at, newest));
}

// Keyframes that came after `adjusted_at` are tied to what they look at and share little with, as it is when
// a recording ends: a map that comes back to a place would else bend until then.
void Mapper::adjust_globally(bool parts_were_apart, KeyframeId adjusted_at) {
  (parts_were_apart ? beside_.closing : beside_.adjusting) = true;
  beside_.aside = told_of_its_end([snapshot = map_, asked = options_, parts_were_apart,
                                   adjusted_at](const std::function<bool()>& cancelled) {
    MapperOptions options = asked;
    options.bundle.cancel = [&] { return cancelled() || (asked.bundle.cancel && asked.bundle.cancel()); };
    Map map = snapshot;
    const std::vector<ViewTie> ties = link_views(options, &map, adjusted_at);
    const auto solved = GlobalAdjustment::solve(options.bundle, map, parts_were_apart || !ties.empty());
    return [=](Mapper& mapper) {
      if (!solved) return;
      tie_views(ties, &mapper.map_);
      const KeyframeChanges all = solved->apply(&mapper.map_);
      mapper.cull_observations(mapper.map_.landmark_ids());
      mapper.post_correction(all);
    };
  });
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
