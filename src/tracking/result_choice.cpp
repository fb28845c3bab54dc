#include "result_choice.h"

#include <cstdint>

#include "finished_maps.h"
#include "mono_pose_tracker/mapping/depth_reversal.h"

namespace mono_pose_tracker {

bool is_sure(const RecordingResult& result) {
  return result.tracked && result.rigidity.is_rigid && result.maps.front().is_sure();
}

bool is_confirmed(const RecordingResult& result) {
  return result.tracked && result.rigidity.is_rigid && result.maps.front().confirmed;
}

bool is_founded(const RecordingResult& result) {
  return result.tracked && result.rigidity.is_rigid && result.maps.front().is_founded;
}

bool fell_apart(const RecordingResult& result) {
  return result.maps.size() > 1 && is_narrow(result.maps.front().map);
}

bool is_short(const RecordingResult& result) { return result.frames_total <= 150; }

bool lacks_images(const RecordingResult& result) {
  return result.tracked && static_cast<std::int64_t>(result.trajectory.size()) < result.frames_total;
}

bool is_most_of(const RecordingResult& result, const RecordingResult& before) {
  constexpr double kMinShare = 0.75;
  return static_cast<double>(result.trajectory.size()) >=
         kMinShare * static_cast<double>(before.trajectory.size());
}

namespace {

// What hangs together by a few points only (an object's other side that looks like this one) is often found
// whole from another beginning, too.
bool is_short_and_loose(const RecordingResult& result) {
  return is_short(result) && (result.maps.size() > 1 || !result.maps.front().seam.holds());
}

// A sure map of few of the images may be bent by what tore it; from another beginning more may hold together.
bool is_in_pieces(const RecordingResult& result) {
  return share_held(result.maps.front(), result.frames_with_features) < 0.5;
}

// Most of the images, and plainly more of them.
bool is_less_in_pieces(const RecordingResult& result, const RecordingResult& before) {
  return result.tracked && result.rigidity.is_rigid && is_in_pieces(before) && !is_in_pieces(result) &&
         !is_most_of(before, result);
}

// A second body, or a map that is wrong about what is near: fewer images are no gain then.
bool is_newly_of_two(const RecordingResult& result, const RecordingResult& before) {
  return result.maps.front().may_be_of_wrong_body && !before.maps.front().may_be_of_wrong_body &&
         result.trajectory.size() < before.trajectory.size();
}

// How many things speak against it, but for its depths: how sure those are is compared apart.
int objections(const RecordingResult& result) {
  const FinishedMap& map = result.maps.front();
  return !result.rigidity.is_rigid + map.objections() + !map.seam.holds();
}

// By a twentieth, as what of its images a map explains is drawn from some thousand matches: good to a few
// hundredths.
bool explains_more(const RecordingResult& result, const RecordingResult& before) {
  constexpr double kPlainly = 1.05;
  const auto explained = [](const RecordingResult& r) {
    return static_cast<double>(r.trajectory.size()) * r.maps.front().other_body.explained();
  };
  return explained(result) > kPlainly * explained(before);
}

// Of two results in doubt, as long at least: less speaks against it, or as much and its depths are surer, or
// it explains more of the recording.
bool is_less_doubtful(const RecordingResult& result, const RecordingResult& before) {
  if (!result.tracked || result.trajectory.size() < before.trajectory.size()) return false;
  const int now = objections(result), then = objections(before);
  const FinishedMap &map = result.maps.front(), &map_before = before.maps.front();
  if (now != then) return now < then;
  if (!map_before.is_depth_sure()) return map.depth_evidence > map_before.depth_evidence;
  return map.is_depth_sure() && explains_more(result, before);
}

// Of two sure results: the one with more images, or with as many that hang together better.
bool holds_more(const RecordingResult& result, const RecordingResult& before) {
  if (result.trajectory.size() != before.trajectory.size())
    return result.trajectory.size() > before.trajectory.size();
  return !before.maps.front().seam.holds();
}

}  // namespace

bool is_enough(const RecordingResult& result, bool is_masked) {
  return is_sure(result) && !fell_apart(result) && !is_in_pieces(result) &&
         (is_masked || !is_short_and_loose(result));
}

bool is_better(const RecordingResult& result, bool is_masked, const RecordingResult& before) {
  if (!before.tracked) return result.tracked;
  if (is_less_in_pieces(result, before)) return true;
  if (is_masked && before.maps.front().shows_background && result.tracked && is_most_of(result, before) &&
      objections(result) <= objections(before)) {
    return true;
  }
  if (is_sure(before))
    return is_founded(result) && holds_more(result, before) && !explains_more(before, result);
  return (is_founded(result) && is_most_of(result, before) && !is_newly_of_two(result, before)) ||
         is_less_doubtful(result, before);
}

}  // namespace mono_pose_tracker
