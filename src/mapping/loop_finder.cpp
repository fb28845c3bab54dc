#include "mapping/loop_finder.h"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

#include "common/threads.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "sorted_unique.h"

namespace mono_pose_tracker {

namespace {

// Keyframes of the map that are connected to this one.
std::vector<KeyframeId> connected_to(const Map& map, KeyframeId keyframe, int min_covisible) {
  std::vector<KeyframeId> connected;
  for (const auto& [id, shared] : map.covisible(keyframe)) {
    if (shared < min_covisible) break;
    connected.push_back(id);
  }
  return connected;
}

/// The keyframe and those connected to it directly or by one between: bundle adjustment corrects the drift
/// among them.
std::unordered_set<KeyframeId> near_in_map(const Map& map, KeyframeId keyframe, int min_covisible) {
  std::unordered_set<KeyframeId> near = {keyframe};
  for (const KeyframeId id : connected_to(map, keyframe, min_covisible)) {
    near.insert(id);
    const std::vector<KeyframeId> next = connected_to(map, id, min_covisible);
    near.insert(next.begin(), next.end());
  }
  return near;
}

bool is_covisible(const Map& map, KeyframeId a, KeyframeId b) { return a == b || map.shared(a, b) > 0; }

// Whether features that both loops match are mostly matched to points that the old place observes elsewhere:
// similar structures, however close together.
bool contradict(const Map& map, const LoopConstraint& first, const LoopConstraint& second,
                double max_disagreement_px) {
  const Keyframe& place = *map.keyframe(first.from);
  const auto pixel_of = [&](LandmarkId id, Eigen::Vector2d* pixel) {
    const Landmark* landmark = map.landmark(id);
    return landmark && place.image->camera.project(place.camera_from_map * landmark->x_in_map, pixel);
  };
  const std::unordered_map<LandmarkId, LandmarkId> old_of(first.matches.begin(), first.matches.end());
  const double limit = max_disagreement_px * image_scale(place.image->camera);
  int both = 0, apart = 0;
  for (const auto& [in_new, in_old] : second.matches) {
    const auto other = old_of.find(in_new);
    if (other == old_of.end()) continue;
    ++both;
    Eigen::Vector2d a, b;
    if (!pixel_of(other->second, &a)) continue;
    apart += !pixel_of(in_old, &b) || (a - b).norm() > limit;
  }
  return 2 * apart > both;
}

}  // namespace

std::vector<KeyframeId> LoopFinder::candidates(const Map& map, const PlaceIndex& index,
                                               KeyframeId keyframe) const {
  const std::unordered_set<KeyframeId> near = near_in_map(map, keyframe, loops_.min_covisible);
  std::vector<KeyframeId> ids;
  for (const PlaceMatch& match :
       index.query(map.keyframe(keyframe)->image->set, kBestPlaces,
                   [&](KeyframeId id) { return map.keyframe(id) && near.count(id) == 0; })) {
    ids.push_back(match.id);
  }
  return ids;
}

bool LoopFinder::agree(const Map& map, const LoopConstraint& first, const LoopConstraint& second) const {
  const double limit = loops_.max_disagreement_px * image_scale(camera_);
  return loop_disagreement_px(map, first, second) < limit && loop_disagreement_px(map, second, first) < limit;
}

std::optional<LoopConstraint> LoopFinder::best_unambiguous(const Map& map,
                                                           std::vector<LoopConstraint> loops) const {
  if (loops.empty()) return std::nullopt;
  std::stable_sort(loops.begin(), loops.end(), [](const LoopConstraint& a, const LoopConstraint& b) {
    return a.support.found > b.support.found;
  });
  for (std::size_t i = 1; i < loops.size(); ++i) {
    if (loops[i].support.found <= loops_.places.aliased_share * loops[0].support.found) continue;
    // Covisible keyframes are one place when their loops agree in the image: their similarities may differ
    // where the depths constrain the scale weakly. Those of two doors in a row do not agree.
    const bool is_ambiguous = is_covisible(map, loops[0].from, loops[i].from)
                                  ? contradict(map, loops[0], loops[i], loops_.max_disagreement_px)
                                  : !agree(map, loops[0], loops[i]);
    if (is_ambiguous) return std::nullopt;
  }
  return std::move(loops[0]);
}

std::optional<LoopConstraint> LoopFinder::find(const Map& map, const PlaceIndex& index, KeyframeId keyframe) {
  if (awaiting_ && ++waited_ > loops_.max_wait) awaiting_.reset();
  std::vector<LoopConstraint> loops;
  const std::vector<KeyframeId> places = candidates(map, index, keyframe);
  std::vector<std::optional<LoopConstraint>> verified(places.size());
  parallel_for(static_cast<int>(places.size()), options_.threads,
               [&](int i) { verified[i] = verify_loop(options_, map, keyframe, places[i], loops_); });
  for (std::optional<LoopConstraint>& loop : verified) {
    if (loop) loops.push_back(std::move(*loop));
  }
  const bool any = !loops.empty();
  std::optional<LoopConstraint> loop = best_unambiguous(map, std::move(loops));
  if (!loop) {
    // Several places are similar: the loop of a neighbour was one of them by chance.
    if (any) awaiting_.reset();
    return std::nullopt;
  }
  if (awaiting_ && is_covisible(map, awaiting_->from, loop->from) && agree(map, *awaiting_, *loop)) {
    loop->matches.insert(loop->matches.end(), awaiting_->matches.begin(), awaiting_->matches.end());
    loop->matches = sorted_unique(std::move(loop->matches));
    awaiting_.reset();
    return loop;
  }
  awaiting_ = std::move(loop);
  waited_ = 0;
  return std::nullopt;
}

}  // namespace mono_pose_tracker
