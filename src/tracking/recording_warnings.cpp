#include "recording_warnings.h"

#include <cmath>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "doubtful_frames.h"
#include "finished_maps.h"
#include "mono_pose_tracker/common/formatted.h"

namespace mono_pose_tracker {

namespace {

constexpr std::size_t kMostNumbers = 10;  // of images in a line

std::string place_text(std::int64_t frame_index) {
  return is_of_earlier_run(frame_index) ? "in the loaded map"
                                        : "at image number " + std::to_string(frame_index);
}

// The largest is not named.
std::string of_map(std::size_t i) { return i == 0 ? "" : " of map_" + std::to_string(i + 1); }

std::string share_text(std::int64_t frame_index, int part, int all) {
  return place_text(frame_index) + " " + std::to_string(part) + " of " + std::to_string(all) + " points";
}

void warn_of_motions(RecordingResult* result) {
  if (result->rigidity.is_rigid) return;
  result->warnings.push_back(
      formatted("more than one motion is in the map: %s and on, the poses that its %s landmarks give "
                "are %.1f px apart; give masks of the object (--masks), or config/object.yaml",
                place_text(result->rigidity.frame_index).c_str(), result->rigidity.parts.c_str(),
                result->rigidity.disagreement_px));
}

void warn_of_seams(RecordingResult* result) {
  for (const FinishedMap& map : result->maps) {
    if (map.seam.holds() || result->rests_on_two_views) continue;
    if (is_of_earlier_run(map.seam.frame_index)) {
      result->warnings.push_back("a part of the loaded map is held to the rest by " +
                                 std::to_string(map.seam.points) +
                                 " points only: its size and place may be wrong");
      continue;
    }
    result->warnings.push_back("images from number " + std::to_string(map.seam.frame_index) +
                               " on are held to those before by " + std::to_string(map.seam.points) +
                               " points only: their size and place beside these may be wrong; more overlap "
                               "between the views would tell");
  }
}

// By the bound that it exceeds.
std::string openness_text(const PathPrecision& path) {
  if (!std::isfinite(path.share())) return " open altogether";
  if (path.share() > PathPrecision::kMostShare)
    return formatted(" open by %.1f %% of its length", 100 * path.share());
  return formatted(" open by %.0f %% of how far the camera came about", 100 * path.sigma / path.extent);
}

void warn_of_path(RecordingResult* result) {
  for (std::size_t i = 0; i < result->maps.size(); ++i) {
    const FinishedMap& map = result->maps[i];
    if (map.is_path_known()) continue;
    result->warnings.push_back(
        "the images leave the path" + of_map(i) + openness_text(*map.path) +
        ": they are few, or the camera moves little beside the distance of what it sees; move on more, come "
        "nearer, or give more images of the same");
  }
}

void warn_of_loose_ends(RecordingResult* result) {
  const std::set<std::int64_t>& out = result->left_out;
  if (out.empty()) return;
  result->warnings.push_back(
      std::to_string(out.size()) + " images between number " + std::to_string(*out.begin()) + " and " +
      std::to_string(*out.rbegin()) +
      " hang on the others by so few points that their place is not known, and have no "
      "pose; more overlap between the views would tell");
}

void warn_of_depth(RecordingResult* result) {
  if (result->maps.front().is_depth_sure()) return;
  result->warnings.push_back(
      "seen from so far away, the depths could as well be reversed and the turns the other way round, or the "
      "turns go farther: turn farther, come nearer, or give masks of what moves as one (--masks)");
}

void warn_of_geometry(RecordingResult* result) {
  if (result->maps.front().is_geometry_sure()) return;
  result->warnings.push_back(
      "what is seen is nearly flat, and another path before another plane fits it about as well: the map may "
      "be of either; go round it, or have something stand out from it");
}

void warn_of_contradictions(RecordingResult* result) {
  const Contradiction& worst = result->maps.front().contradiction;
  if (!worst.is_significant()) return;
  result->warnings.push_back(
      share_text(worst.frame_index, worst.contradicting, worst.matches) +
      " are seen elsewhere than the map has them: more than one thing moves, or the map is wrong from "
      "there on; give masks of what moves as one (--masks), or record it again with more overlap");
}

void warn_of_misplaced_view(RecordingResult* result) {
  const MisplacedView& worst = result->maps.front().misplaced;
  if (!worst.is_significant()) return;
  result->warnings.push_back(
      share_text(worst.frame_index, worst.elsewhere, worst.landmarks) + " of what is seen " +
      place_text(worst.other_frame_index) +
      ", which looks like it, are elsewhere than the map has them: a part of the "
      "recording was put in a wrong place; do without that part, or record it again with more overlap");
}

void warn_of_torn_tracks(RecordingResult* result) {
  const TornTracks& worst = result->maps.front().torn_tracks;
  if (!worst.is_significant()) return;
  result->warnings.push_back(
      share_text(worst.frame_index, worst.torn, worst.matches) +
      " have two places in the map, as no one place agrees with all that is seen of them: the map may "
      "be wrong about there; give masks of what moves as one (--masks), or record it again with more "
      "overlap");
}

void warn_of_still_landmarks(RecordingResult* result) {
  const StillLandmarks& still = result->maps.front().still;
  if (!still.is_significant()) return;
  result->warnings.push_back(
      formatted("%d of %d points stay in their place in the image where the map has them move: it is of what "
                "moves and of what stands still at once; give masks of what moves (--masks)",
                still.still, still.matches));
}

void warn_of_collapse(RecordingResult* result) {
  const ScaleCollapse& worst = result->maps.front().collapse;
  if (!worst.is_significant()) return;
  result->warnings.push_back(
      share_text(worst.frame_index, worst.near, worst.landmarks) +
      " lie at the lens: the images about there hang on the others by far things only, and their part of the "
      "map has shrunk to a point; turn more slowly and move on meanwhile, with something near in view");
}

void warn_of_restless_path(RecordingResult* result) {
  const RestlessPath& worst = result->maps.front().restless;
  if (!worst.is_significant()) return;
  result->warnings.push_back(
      formatted("from image number %ld on the path jumps to and fro, %d times in %d images: places that look "
                "alike were "
                "taken for each other; do without these images, or record them again with more overlap",
                static_cast<long>(worst.frame_index), worst.jumps, RestlessPath::kFrames));
}

void warn_of_background(RecordingResult* result) {
  if (!result->maps.front().shows_background) return;
  result->warnings.push_back(
      "something moves before a background that stands still, and the map may be of both: give masks of what "
      "moves (--masks)");
}

// Two bodies, of which a map can be of one only.
void warn_of_other_body(RecordingResult* result) {
  const FinishedMap& map = result->maps.front();
  const OtherBody& other = map.other_body;
  const long percent = std::lround(100 * other.share()), of_view = std::lround(100 * other.share_of_view());
  if (map.is_of_other_body) {
    result->warnings.push_back(
        "two bodies move, each as one, and the map's is not plainly the one that turns, as segmentation/body "
        "asks: " +
        std::to_string(percent) +
        " % of the points move with another that turns as far or farther; give masks of the one that is "
        "wanted (--masks)");
  } else if (other.is_comparable()) {
    result->warnings.push_back(
        "two bodies move, each as one, or the map is wrong about what is near: " + std::to_string(percent) +
        " % of the points, in " + std::to_string(of_view) +
        " % of the view, move otherwise than it says, and are left out; where they are what is wanted, give "
        "masks of it (--masks), or segmentation/body: turning for what turns (config/object.yaml)");
  }
}

void warn_of_parts(RecordingResult* result) {
  if (result->maps.size() < 2) return;
  const std::size_t apart = frames_beside_first(result->maps);
  result->warnings.push_back(
      "the recording fell into " + std::to_string(result->maps.size()) +
      " maps that nothing ties together: " + std::to_string(apart) +
      " images are not in the first; each has a frame and a unit of its own (map_2, ...); of fewer than " +
      std::to_string(kLeastBesideFirst) + " images none beside the first is confirmed");
}

void warn_of_little(RecordingResult* result) {
  const FinishedMap& first = result->maps.front();
  if (!first.holds_little) return;
  result->warnings.push_back("the first map holds " + std::to_string(first.trajectory.size()) + " of " +
                             std::to_string(result->frames_total) +
                             " images only, and none is confirmed: where so many are lost, what is left may "
                             "be bent as well; more overlap between the views would tell");
}

// What is not posed is easily overlooked in a trajectory.
void warn_of_unposed(RecordingResult* result) {
  constexpr double kMostShare = 0.1;  // fewer are the few blurred ones that every recording has
  std::set<std::int64_t> posed;
  for (const FinishedMap& map : result->maps) posed.merge(frames_of(map.trajectory));
  std::int64_t unposed = 0, run = 0, longest = 0, last = -1;
  for (const auto& name : result->names) {
    const bool has_none = posed.count(name.first) == 0;
    unposed += has_none;
    run = has_none ? run + 1 : 0;
    if (run > longest) longest = run, last = name.first;
  }
  if (static_cast<double>(unposed) <= kMostShare * static_cast<double>(result->frames_total)) return;
  result->warnings.push_back(std::to_string(unposed) + " of " + std::to_string(result->frames_total) +
                             " images have no pose, most in a row from number " +
                             std::to_string(last - longest + 1) + " to " + std::to_string(last) +
                             ": dark, blurred, or too little overlap with the others");
}

std::string some_of(const std::vector<std::int64_t>& frames) {
  std::string numbers;
  for (std::size_t i = 0; i < frames.size() && i < kMostNumbers; ++i) {
    numbers += (i == 0 ? "" : ", ") + std::to_string(frames[i]);
  }
  return frames.size() > kMostNumbers ? numbers + ", ..." : numbers;
}

void warn_of_doubtful_poses(RecordingResult* result) {
  for (std::size_t i = 0; i < result->maps.size(); ++i) {
    const std::vector<PosedFrame>& trajectory = result->maps[i].trajectory;
    const std::vector<std::int64_t> alone = doubtful_alone(trajectory, result->doubtful);
    const bool all_may_be_off = may_lead_astray(alone.size(), trajectory.size());
    // Of a map beside the largest only what costs it its confirmation.
    if (alone.empty() || (i > 0 && !all_may_be_off)) continue;
    result->warnings.push_back(
        "the poses of " + std::to_string(alone.size()) + " images" + of_map(i) + " are doubtful (number " +
        some_of(alone) +
        "): they rest on few points and lie away from where the motion led, or beyond a "
        "gap with no keyframe among them; do without "
        "them where a wrong one does harm" +
        (all_may_be_off ? "; the path is so short that they may take all of it off" : ""));
  }
}

}  // namespace

void warn_of_doubts(RecordingResult* result) {
  warn_of_motions(result);
  warn_of_parts(result);
  warn_of_little(result);
  warn_of_unposed(result);
  warn_of_doubtful_poses(result);
  warn_of_seams(result);
  warn_of_path(result);
  warn_of_loose_ends(result);
  warn_of_depth(result);
  warn_of_geometry(result);
  warn_of_contradictions(result);
  warn_of_misplaced_view(result);
  warn_of_torn_tracks(result);
  warn_of_still_landmarks(result);
  warn_of_collapse(result);
  warn_of_restless_path(result);
  warn_of_background(result);
  warn_of_other_body(result);
}

}  // namespace mono_pose_tracker
