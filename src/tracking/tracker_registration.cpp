// The end of a recording: refinement with the view graph, registration of an image by all its edges, and the
// adjustment of images between the keyframes.

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "mono_pose_tracker/robust/absolute_pose.h"
#include "robust/motion_refinement.h"
#include "tracker_impl.h"

namespace mono_pose_tracker {

namespace {

std::vector<KeyframeId> nearest_in_time(const TrackingMap& map, std::int64_t frame_index, std::size_t before,
                                        std::size_t after) {
  std::vector<std::pair<std::int64_t, KeyframeId>> earlier, later;
  for (const auto& [id, keyframe] : map.keyframes) {
    const std::int64_t distance = keyframe.frame_index - frame_index;
    if (distance != 0) (distance < 0 ? earlier : later).emplace_back(std::abs(distance), id);
  }
  std::vector<KeyframeId> nearest;
  for (auto [side, most] : {std::pair(&earlier, before), {&later, after}}) {
    const auto end = side->begin() + static_cast<std::ptrdiff_t>(std::min(most, side->size()));
    std::partial_sort(side->begin(), end, side->end());
    for (auto entry = side->begin(); entry != end; ++entry) nearest.push_back(entry->second);
  }
  return nearest;
}

// Frames whose poses are relative to one of the keyframes, including those of removed keyframes stored
// relative to it, and those next to it in time, which probably have the same error.
std::set<std::int64_t> frames_on(const TrackingMap& map, const FramePoses& poses,
                                 const std::set<KeyframeId>& keyframes) {
  const auto stands_on_one = [&](KeyframeId id) {
    return keyframes.count(living_ancestor(map.removed_keyframes, id)) > 0;
  };
  std::map<std::int64_t, bool> is_one;  // by frame of each keyframe
  for (const auto& [id, keyframe] : map.keyframes) is_one[keyframe.frame_index] = keyframes.count(id) > 0;
  const auto is_next_to_one = [&](std::int64_t index) {
    const auto after = is_one.lower_bound(index);
    return (after != is_one.end() && after->second) || (after != is_one.begin() && std::prev(after)->second);
  };
  std::set<std::int64_t> frames;
  for (const auto& [index, pose] : poses.all()) {
    if (stands_on_one(pose.reference) || (!is_one.count(index) && is_next_to_one(index)))
      frames.insert(index);
  }
  for (const KeyframeId id : keyframes) frames.insert(map.keyframes.at(id).frame_index);
  for (const auto& [id, link] : map.removed_keyframes) {
    if (stands_on_one(id)) frames.insert(link.frame_index);
  }
  return frames;
}

}  // namespace

// The keyframes' nodes in the view graph, except the image's own. Missing edges to the image are computed.
std::map<KeyframeId, int> Tracker::Impl::connected_to(const Frame& frame, const TrackingMap& map,
                                                      const std::vector<KeyframeId>& keyframes) {
  ViewGraph& graph = view_graph();
  const int image = graph.add(frame.index, frame.image);
  std::map<KeyframeId, int> nodes;
  std::vector<ViewGraph::Pair> pairs;
  for (const KeyframeId id : keyframes) {
    const KeyframeView& keyframe = map.keyframes.at(id);
    const int node = graph.add(keyframe.frame_index, keyframe.image);
    if (node == image) continue;
    nodes[id] = node;
    pairs.emplace_back(image, node);
  }
  graph.connect(pairs);
  return nodes;
}

// Whether the pose explains most of the verified matches with landmarks of these keyframes; nothing where
// there are too few.
std::optional<bool> Tracker::Impl::agrees_with_graph(const Frame& frame,
                                                     const std::map<KeyframeId, int>& nodes,
                                                     const TrackingMap& map, const Rigid3& camera_from_map) {
  const ViewGraph& graph = view_graph();
  const int image = graph.node_of(frame.index, frame.image);
  int matches = 0, explained = 0;
  for (const auto& [id, node] : nodes) {
    const KeyframeView& keyframe = map.keyframes.at(id);
    const std::vector<char> by_pose =
        graph.explained_by({node, image}, camera_from_map * keyframe.camera_from_map.inverse());
    for (const VerifiedMatch& m : graph.verified_matches(node, image)) {
      if (m.motion != 1 || keyframe.landmark_of_feature[m.first] == kNoLandmark) continue;
      ++matches;
      explained += by_pose[m.index] != 0;
    }
  }
  if (matches < graph.options().min_inliers) return std::nullopt;
  return 2 * explained > matches;
}

// Registers from the prediction. Where that fails, or the graph contradicts it, by P3P in RANSAC over the
// verified matches of all edges to landmarks, followed by guided matching.
RegistrationReport Tracker::Impl::register_image(const Frame& frame, const TrackingMap& map,
                                                 const std::optional<Prediction>& prediction) {
  std::vector<KeyframeId> keyframes =
      nearest_in_time(map, frame.index, limits_.edges_before, limits_.edges_after);
  std::set<KeyframeId> known(keyframes.begin(), keyframes.end());
  for (const KeyframeId id :
       map.places ? map.places->find(frame.image->set, limits_.similar_edges) : std::vector<KeyframeId>()) {
    if (map.keyframes.count(id) && known.insert(id).second) keyframes.push_back(id);
  }
  const std::map<KeyframeId, int> nodes = connected_to(frame, map, keyframes);
  if (prediction) {
    const RegistrationReport expected =
        registrar_.register_frame(frame, map, prediction->reference, prediction->camera_from_map);
    // The neighbouring frame supports a pose found from its prediction, unless such a prediction was wrong
    // before.
    const bool is_followed = expected.success && expected.is_where_predicted &&
                             !is_confined_to_corner(expected.support) && withdrawn_.count(frame.index) == 0;
    if ((is_followed || is_found(expected)) &&
        agrees_with_graph(frame, nodes, map, expected.camera_from_map).value_or(true))
      return expected;
  }
  std::set<std::pair<int, LandmarkId>> matches;
  std::map<KeyframeId, int> support;
  const int image = view_graph().node_of(frame.index, frame.image);
  for (const auto& [id, node] : nodes) {
    for (const VerifiedMatch& m : view_graph().verified_matches(node, image)) {
      const LandmarkId landmark = map.keyframes.at(id).landmark_of_feature[m.first];
      if (map.landmarks.find(landmark) == map.landmarks.end()) continue;
      matches.emplace(m.second, landmark);
      ++support[id];
    }
  }
  std::vector<Eigen::Vector3d> bearings, points;
  for (const auto& [feature, landmark] : matches) {
    bearings.push_back(frame.image->set.bearings[feature]);
    points.push_back(map.landmarks.at(landmark));
  }
  RegistrationReport report;
  report.text = "too few verified matches to landmarks";
  AbsolutePoseOptions pose = AbsolutePoseOptions::in_growing_map(options_.ransac(camera_.focal()));
  pose.ransac.seed += static_cast<std::uint64_t>(frame.index);
  const AbsolutePoseReport found = estimate_absolute_pose(bearings, points, pose);
  if (!found.success || found.num_inliers < options_.resection.min_inliers) return report;
  const auto reference = std::max_element(support.begin(), support.end(),
                                          [](const auto& a, const auto& b) { return a.second < b.second; });
  report = registrar_.register_frame(frame, map, reference->first, found.camera_from_map);
  report.success =
      is_found(report) && agrees_with_graph(frame, nodes, map, report.camera_from_map).value_or(true);
  return report;
}

// Registers from the keyframes before and after, which constrain most; where the graph does not support that,
// from all edges.
RegistrationReport Tracker::Impl::register_again(const Frame& frame, const TrackingMap& map) {
  const RegistrationReport near = register_near_in_time(frame, map, 2);
  if (is_found(near) &&
      agrees_with_graph(frame, connected_to(frame, map, nearest_in_time(map, frame.index, 1, 1)), map,
                        near.camera_from_map)
          .value_or(false)) {
    return near;
  }
  return register_image(frame, map, std::nullopt);
}

std::set<std::int64_t> Tracker::Impl::refine_with_graph() {
  if (options_.localize_only || !worker_.latest()) return {};
  const TrackingMapPtr before = worker_.latest();
  return erase_frames_on(*before, worker_.mapper().refine_with_graph());
}

std::set<std::int64_t> Tracker::Impl::withdraw_unsupported() {
  if (options_.localize_only || !worker_.latest()) return {};
  const TrackingMapPtr before = worker_.latest();
  std::map<std::int64_t, Rigid3> camera_from_map;
  for (const auto& entry : before->keyframes)  // those of earlier runs as well
    camera_from_map[entry.second.frame_index] = entry.second.camera_from_map;
  for (const RegisteredFrame& frame : trajectory_in(*before, frames_[before->map_id]))
    camera_from_map[frame.index] = frame.map_from_camera.inverse();
  const std::set<std::int64_t> unsupported = unsupported_images(view_graph(), camera_from_map, {});
  // Where they are more than half, something else is wrong.
  if (unsupported.empty() || 2 * unsupported.size() > camera_from_map.size()) return {};
  std::set<KeyframeId> keyframes;
  for (const auto& [id, keyframe] : before->keyframes) {
    if (unsupported.count(keyframe.frame_index)) keyframes.insert(id);
  }
  erase_frames_on(*before, worker_.mapper().remove_wrong(keyframes));
  for (const std::int64_t index : unsupported) frames_[worker_.latest()->map_id].erase(index);
  return unsupported;
}

// Erases the poses of frames relative to keyframes that were removed from the map, and returns the frames.
std::set<std::int64_t> Tracker::Impl::erase_frames_on(const TrackingMap& before,
                                                      const std::set<KeyframeId>& removed) {
  std::set<std::int64_t> frames;
  if (!removed.empty()) frames = frames_on(before, frames_[before.map_id], removed);
  follow_mapper();
  for (const std::int64_t index : frames) frames_[worker_.latest()->map_id].erase(index);
  return frames;
}

// Adjusts the poses of the images between keyframes, from the present positions of the landmarks by which
// they were registered. Returns the images with which most of these landmarks are no longer consistent.
std::set<std::int64_t> Tracker::Impl::adjust_frames(const TrackingMap& map) {
  std::set<std::int64_t> outdated;
  // A map used for localisation only is not changed.
  if (options_.localize_only) return outdated;
  FramePoses& poses = frames_[map.map_id];
  std::set<std::int64_t> of_keyframes;
  for (const auto& entry : map.keyframes) of_keyframes.insert(entry.second.frame_index);
  for (const auto& [index, pose] : poses.all()) {
    if (pose.is_stale && !of_keyframes.count(index)) outdated.insert(index);
  }
  for (const RegisteredFrame& frame : trajectory_in(map, poses)) {
    if (of_keyframes.count(frame.index) || outdated.count(frame.index)) continue;
    FramePose pose = *poses.find(frame.index);
    std::optional<Rigid3> adjusted;
    if (pose.landmarks) adjusted = pose_by_landmarks(map, *pose.landmarks, frame.map_from_camera.inverse());
    Rigid3 reference_from_map;
    if (!adjusted || !map.camera_from_map(pose.reference, &reference_from_map)) {
      outdated.insert(frame.index);
      continue;
    }
    pose.camera_from_reference = *adjusted * reference_from_map.inverse();
    pose.is_final = true;
    poses.set(frame.index, pose);
  }
  return outdated;
}

// None where the inliers are fewer than an edge of the view graph needs, or than half of the landmarks.
std::optional<Rigid3> Tracker::Impl::pose_by_landmarks(const TrackingMap& map,
                                                       const std::vector<LandmarkPixel>& landmarks,
                                                       const Rigid3& initial) {
  std::vector<Eigen::Vector3d> bearings, points;
  std::vector<double> sigmas;
  for (const LandmarkPixel& observed : landmarks) {
    const auto landmark = map.landmarks.find(observed.landmark);
    if (landmark == map.landmarks.end()) continue;
    bearings.push_back(camera_.bearing(observed.pixel.cast<double>()));
    points.push_back(landmark->second);
    sigmas.push_back(observed.sigma_px / camera_.focal());
  }
  const auto least = std::max<std::size_t>(view_graph().options().min_inliers, landmarks.size() / 2);
  if (points.size() < least) return std::nullopt;
  const MotionRefinementReport refined = refine_absolute_pose(bearings, points, sigmas, initial, {});
  if (!refined.converged) return std::nullopt;
  std::size_t agreeing = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d direction = (refined.camera_from_map * points[i]).normalized();
    agreeing += (direction - bearings[i]).norm() < options_.inlier_threshold_px * sigmas[i];
  }
  if (agreeing < least) return std::nullopt;
  return refined.camera_from_map;
}

}  // namespace mono_pose_tracker
