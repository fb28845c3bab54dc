#include "recording_files.h"

#include <algorithm>
#include <cstdio>
#include <functional>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "alignment.h"
#include "common/threads.h"
#include "io/files.h"
#include "io/image_coding.h"
#include "io/plot.h"
#include "io/undistortion.h"
#include "mapping/graph_consistency.h"
#include "model_export.h"
#include "mono_pose_tracker/evaluation/trajectory_error.h"
#include "mono_pose_tracker/io/ply.h"
#include "pipeline/object_masks.h"
#include "tools/json.h"

namespace mono_pose_tracker {

namespace fs = std::filesystem;

namespace {

void write_into(const fs::path& path, const cv::Mat& image) {
  make_folder(path.parent_path());
  write_image(path.string(), image);
}

// Until the recording is interrupted.
void for_each_image(const Recording& recording, const RecordingResult& result,
                    const std::function<void(std::int64_t, const SourceImage&)>& visit) {
  const std::unique_ptr<ImageSource> source = recording.open();
  for (std::int64_t index = 0; index < result.frames_total && !recording.interrupted();) {
    const SourceImage image = source->next();
    if (image.kind == SourceImage::Kind::kEnd) return;
    if (image.kind == SourceImage::Kind::kImage) visit(index++, image);
  }
}

// True camera positions in the map. Empty when the trajectories overlap too little.
std::vector<Eigen::Vector3d> true_positions(const std::vector<StampedPose>& reference,
                                            const std::vector<StampedPose>& poses) {
  constexpr std::int64_t kMaxDifference = 10'000'000;  // ns: what evaluate_trajectory allows by default
  std::vector<Eigen::Vector3d> positions;
  try {
    const Sim3 s = evaluate_trajectory(reference, poses, kMaxDifference).reference_from_estimate;
    for (const StampedPose& pose : reference) {
      positions.push_back(s.rotation.conjugate() * (pose.map_from_camera.translation - s.translation) /
                          s.scale);
    }
  } catch (const std::runtime_error& e) {
    std::fprintf(stderr, "the reference is not drawn: %s\n", e.what());
  }
  return positions;
}

fs::path map_folder(const fs::path& output, std::size_t i) {
  return i == 0 ? output : output / ("map_" + std::to_string(i + 1));
}

void turn(const Eigen::Quaterniond& view_from_map, Overview* overview) {
  for (ColoredPoint& point : overview->points) {
    point.x_in_map = view_from_map.cast<float>() * point.x_in_map;
  }
  for (auto* positions : {&overview->cameras, &overview->true_cameras}) {
    for (Eigen::Vector3d& x : *positions) x = view_from_map * x;
  }
}

void write_map(const fs::path& output, const CameraParameters& camera, const RecordingResult& result,
               const FinishedMap& map, const std::vector<StampedPose>& reference,
               const AlignedResult& aligned) {
  std::vector<StampedPose> poses;
  Overview overview;
  for (const RegisteredFrame& frame : map.trajectory) {
    poses.push_back({frame.stamp_ns, frame.map_from_camera});
    if (&frame != &map.trajectory.front() && frame.index != (&frame - 1)->index + 1) {
      overview.cameras.push_back(no_camera());
    }
    overview.cameras.push_back(frame.map_from_camera.translation);
  }
  write_tum((output / "trajectory.txt").string(), poses);
  const bool is_first = &map == &result.maps.front();
  const bool confirmed = is_first ? is_confirmed(result) : map.confirmed();
  overview.points = map.snapshot->points;
  overview.title = std::to_string(poses.size()) + " of " + std::to_string(result.frames_total) +
                   " images registered, " + std::to_string(overview.points.size()) + " points" +
                   (confirmed ? "" : "; NOT confirmed: see report.json");
  if (map.map.scale_source() != ScaleSource::kMapUnits) overview.unit = "m";
  if (!reference.empty()) overview.true_cameras = true_positions(reference, poses);
  Overview drawn = overview;
  if (aligned.world_from_map.count(map.id) > 0) turn(view_from_map(map.trajectory), &drawn);
  write_ply((output / "points.ply").string(), overview.points);
  write_overview((output / "overview.png").string(), drawn);
  write_map_for_colmap((output / "colmap").string(), camera, map, map.trajectory, result.names,
                       [](const Eigen::Vector2d& pixel) { return pixel; });
}

/// Readers of training images expect three channels.
cv::Mat in_colour(const cv::Mat& image) {
  cv::Mat result = image;
  if (image.channels() == 1) cv::cvtColor(image, result, cv::COLOR_GRAY2BGR);
  return result;
}

bool most_have(const MaskRecord& masks, const RecordingResult& result) {
  return 2 * masks.frames() >= static_cast<std::size_t>(result.frames_total);
}

}  // namespace

void write_pages(const fs::path& output, const CameraParameters& camera, const FrameNotes& notes,
                 const Thumbnails& thumbnails, const RecordingResult& result) {
  for (std::size_t i = 0; i < result.maps.size(); ++i) {
    write_scene_page((map_folder(output, i) / "overview.html").string(),
                     recording_page(result, result.maps[i], camera, notes, thumbnails));
  }
}

void outline_masks(const Recording& recording, const RecordingResult& result, const CameraModel& camera,
                   MaskRecord* masks) {
  const FinishedMap& first = result.maps.front();
  if (first.other_object == OtherObject::kMayBeTurning || first.other_object == OtherObject::kLarger)
    return;  // its outline is of what is not wanted
  const ObjectOutlines outlines(result, camera);
  if (!outlines.have_other() && !most_have(*masks, result)) return;
  struct Outlined {
    std::int64_t index;
    cv::Mat image, mask;
  };
  std::vector<Outlined> several;
  const auto outline = [&] {
    parallel_for(static_cast<int>(several.size()), recording.threads, [&](int i) {
      several[i].mask = outlines.outlined(several[i].index, several[i].image, several[i].mask);
    });
    for (const Outlined& o : several) {
      if (!o.mask.empty()) masks->replace(o.index, o.mask);
    }
    several.clear();
  };
  for_each_image(recording, result, [&](std::int64_t index, const SourceImage& image) {
    several.push_back({index, image.image, masks->mask(index)});
    if (several.size() >= 4 * static_cast<std::size_t>(recording.threads)) outline();
  });
  outline();
}

void write_masks(const fs::path& folder, const Recording& recording, const RecordingResult& result,
                 const MaskRecord& masks) {
  make_folder(folder);
  std::set<fs::path> written;
  for_each_image(recording, result, [&](std::int64_t index, const SourceImage& image) {
    const cv::Mat mask = masks.mask(index);
    if (mask.empty()) return;
    fs::path name = fs::path(image.name).replace_extension(".png");
    if (!written.insert(name).second) name = image.name + ".png";  // a.png and a.jpg
    write_into(folder / name, mask);
  });
}

void write_frames(const fs::path& folder, const Recording& recording, const RecordingResult& result) {
  make_folder(folder);
  for_each_image(recording, result, [&](std::int64_t, const SourceImage& image) {
    write_into(folder / image.name, image.image);
  });
}

void write_undistorted(const fs::path& folder, const CameraModel& camera, const Recording& recording,
                       const RecordingResult& result, const MaskRecord& masks) {
  const Undistorter undistorter(camera);
  std::map<std::int64_t, RegisteredFrame> registered;
  for (const RegisteredFrame& frame : result.trajectory) registered[frame.index] = frame;
  std::vector<RegisteredFrame> written;
  // Images without a mask are excluded among outlines of an object, because they would add its background.
  // With given masks, no mask means that nothing is ignored.
  const bool are_of_object = !recording.masks && most_have(masks, result);
  std::string pairs, fused;
  for_each_image(recording, result, [&](std::int64_t index, const SourceImage& image) {
    if (registered.count(index) == 0) return;
    const std::string& name = image.name;
    cv::Mat mask = masks.mask(index);
    if (mask.empty() && are_of_object) mask = cv::Mat::zeros(image.image.size(), CV_8UC1);
    write_into(folder / "images" / name, in_colour(undistorter.image(image.image)));
    write_into(folder / "masks" / (name + ".png"), undistorter.mask(mask));
    pairs += name + "\n__auto__, 20\n";
    fused += name + "\n";
    written.push_back(registered.at(index));
  });
  const ColmapModel model =
      colmap_model_of(undistorter.camera(), result.maps.front(), written, result.names,
                      [&](const Eigen::Vector2d& pixel) { return undistorter.pixel(pixel); });
  write_colmap_text((folder / "sparse").string(), undistorter.camera(), model.images, model.points);
  write_splat_dataset(folder.string(), undistorter.camera(), model.images, model.points);
  for (const char* part : {"depth_maps", "normal_maps", "consistency_graphs"}) {
    make_folder(folder / "stereo" / part);
  }
  const auto write = [&](const char* name, const std::string& text) {
    write_file_atomically((folder / "stereo" / name).string(), [&](std::ostream& out) { out << text; });
  };
  write("patch-match.cfg", pairs);
  write("fusion.cfg", fused);
}

void write_results(const fs::path& output, const CameraParameters& camera, const RecordingResult& result,
                   const std::vector<StampedPose>& reference, const AlignedResult& aligned) {
  for (std::size_t i = 0; i < result.maps.size(); ++i) {
    const fs::path folder = map_folder(output, i);
    make_folder(folder);
    write_map(folder, camera, result, result.maps[i], reference, aligned);
  }
}

namespace {

std::map<ViewGraph::Pair, EdgeConsistency> edges_of(const ViewGraph& graph, const Map& map) {
  GraphConsistencyOptions all;
  all.min_inliers = 1;
  std::map<ViewGraph::Pair, EdgeConsistency> edges;
  for (const EdgeConsistency& edge : edge_consistency(map, graph, all)) edges.emplace(edge.pair, edge);
  return edges;
}

cv::Scalar color_of(double explained_share) {
  constexpr double kFull = 210;
  return {0, kFull * explained_share, kFull * (1 - explained_share)};  // BGR
}

}  // namespace

void write_view_graph(const std::string& path, const ViewGraph& graph, const Map& map) {
  const std::map<ViewGraph::Pair, EdgeConsistency> edges = edges_of(graph, map);
  write_file_atomically(path, [&](std::ostream& out) {
    for (const auto& [pair, geometry] : graph.edges()) {
      const auto edge = edges.find(pair);
      const Json line = {
          {"frames", {graph.nodes()[pair.first].frame_index, graph.nodes()[pair.second].frame_index}},
          {"type", to_string(geometry.type)},
          {"matches", geometry.matches.size()},
          {"inliers", {geometry.inliers(1), geometry.inliers(2)}},
          {"explained", edge == edges.end() ? Json() : Json(edge->second.explained)}};
      out << line.dump() << '\n';
    }
  });
}

void draw_view_graph(const std::string& path, const ViewGraph& graph, const Map& map) {
  constexpr int kSidePx = 1000;
  const cv::Scalar unknown(190, 190, 190);
  const std::map<ViewGraph::Pair, EdgeConsistency> edges = edges_of(graph, map);
  PlotSeries pairs;
  pairs.radius_px = 3;
  pairs.is_square = true;
  double last = 1;
  for (const auto& [pair, geometry] : graph.edges()) {
    if (geometry.type == TwoViewType::kDegenerate) continue;
    const auto first = static_cast<double>(graph.nodes()[pair.first].frame_index),
               second = static_cast<double>(graph.nodes()[pair.second].frame_index);
    pairs.points.emplace_back(std::min(first, second), std::max(first, second));
    last = std::max({last, first, second});
    const auto edge = edges.find(pair);
    pairs.colors.push_back(
        edge == edges.end() ? unknown
                            : color_of(static_cast<double>(edge->second.explained) / edge->second.matches));
  }
  PlotPanel panel;
  panel.title = "view graph: verified matches explained by the map, none (red) to all (green)";
  panel.x_label = "image";
  panel.y_label = "image";
  panel.x = panel.y = with_margin({0, last}, 0.02);
  panel.equal_axes = true;
  panel.series = {pairs};
  cv::Mat picture(kSidePx, kSidePx, CV_8UC3, cv::Scalar::all(255));
  draw_panel(panel, {0, 0, kSidePx, kSidePx}, &picture);
  write_picture(path, picture);
}

}  // namespace mono_pose_tracker
