#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "mono_pose_tracker/map/frame_poses.h"
#include "mono_pose_tracker/map/map.h"
#include "mono_pose_tracker/mapping/contradiction.h"
#include "mono_pose_tracker/mapping/depth_reversal.h"
#include "mono_pose_tracker/mapping/misplaced_view.h"
#include "mono_pose_tracker/mapping/other_body.h"
#include "mono_pose_tracker/mapping/path_precision.h"
#include "mono_pose_tracker/mapping/rival_geometry.h"
#include "mono_pose_tracker/mapping/scale_collapse.h"
#include "mono_pose_tracker/mapping/seam.h"
#include "mono_pose_tracker/mapping/still_landmarks.h"
#include "mono_pose_tracker/mapping/torn_tracks.h"
#include "mono_pose_tracker/tracking/frame_report.h"
#include "mono_pose_tracker/tracking/restless_path.h"

namespace mono_pose_tracker {

/// One of the maps that a recording ended in.
struct FinishedMap {
  std::uint32_t id = 0;
  std::vector<PosedFrame> trajectory;
  RegisteredLandmarks registered;  // what the images of the trajectory were posed by
  Map map;
  std::shared_ptr<const MapSnapshot> snapshot;
  Seam seam;  // where it hangs together least
  /// How well its images know their way: of a map that is founded, and not too large to be asked.
  std::optional<PathPrecision> path;
  Contradiction contradiction;  // where most of what is seen speaks against it
  MisplacedView misplaced;      // which another that looks like it has elsewhere
  TornTracks torn_tracks;       // where more is seen as two things than is usual in it
  StillLandmarks still;         // what it sees keep its place though the map has it move
  ScaleCollapse collapse;       // where a part of it has shrunk to a point
  RestlessPath restless;        // where its images jump to and fro
  OtherBody other_body;         // that its images show as well
  // The body that turns is asked for, and it is the other one, or may be.
  bool is_of_other_body = false;
  // The largest is asked for, and another is larger.
  bool is_of_smaller_body = false;
  // Another body may as well be what is wanted, as only the larger was asked for. If but one thing moves
  // after all, the map is wrong about what is near, and holds together by what is far.
  bool may_be_of_wrong_body = false;
  /// Where segmentation/body asks for the body that turns: what was seen of it and of what moves otherwise.
  std::vector<BodyTrack> beside;
  // The first of a recording, of whose images it holds less than two thirds.
  bool holds_little = false;
  // Its images show one that stands still, and no mask has told it from what moves.
  bool shows_background = false;
  double depth_evidence = 0;     // that it is not reversed in depth (mapping/depth_reversal.h)
  double geometry_evidence = 0;  // that it did not begin as a plane's twin (mapping/rival_geometry.h)
  bool is_founded = false;       // a third view confirmed its beginning, it is sure, and its seams hold
  bool confirmed = false;        // that, it is of what was asked for, is_path_known, few poses are doubtful,
                                 // it is of most of the recording

  bool is_depth_sure() const { return depth_evidence >= kMinDepthEvidence; }
  /// Or it was not asked: something else speaks against the map, or it is only localised in.
  bool is_path_known() const { return !path || path->is_known(); }
  bool is_geometry_sure() const { return geometry_evidence >= kMinGeometryEvidence; }
  /// How many things in it speak against it. Its depths and its weakest seam are not among them.
  int objections() const {
    return contradiction.is_significant() + misplaced.is_significant() + torn_tracks.is_significant() +
           still.is_significant() + collapse.is_significant() + restless.is_significant() + is_of_other_body +
           is_of_smaller_body + shows_background + !is_geometry_sure();
  }
  /// Nothing in it speaks against it; it may hang together by little.
  bool is_sure() const { return is_depth_sure() && objections() == 0; }
};

}  // namespace mono_pose_tracker
