#include "colmap_model.h"

#include <algorithm>
#include <set>

#include "mono_pose_tracker/io/colmap.h"

namespace mono_pose_tracker {

void write_map_for_colmap(const std::string& folder, const CameraParameters& camera, const Map& map,
                          const std::vector<PosedFrame>& trajectory,
                          const std::map<std::int64_t, std::string>& names, const PixelChange& changed) {
  std::set<std::int64_t> written;
  for (const PosedFrame& frame : trajectory) written.insert(frame.index);
  std::vector<ColmapPoint> points;
  std::map<LandmarkId, int> index_of;
  for (const LandmarkId id : map.landmark_ids()) {
    const Landmark& landmark = *map.landmark(id);
    // Of a loaded map, what only earlier runs have seen has no image here.
    if (std::none_of(landmark.observations.begin(), landmark.observations.end(), [&](const Observation& o) {
          return written.count(map.keyframe(o.keyframe)->frame_index) > 0;
        })) {
      continue;
    }
    ColmapPoint point;
    point.x_in_map = landmark.x_in_map;
    for (const Observation& o : landmark.observations) {
      const Keyframe& keyframe = *map.keyframe(o.keyframe);
      point.error_px +=
          reprojection_error(*keyframe.image, o.feature, keyframe.camera_from_map * landmark.x_in_map)
              .norm() /
          landmark.observations.size();
    }
    const Observation& first = landmark.observations.front();
    const cv::Vec3b& rgb = map.keyframe(first.keyframe)->image->color_rgb[first.feature];
    point.r = rgb[0], point.g = rgb[1], point.b = rgb[2];
    index_of[id] = static_cast<int>(points.size());
    points.push_back(point);
  }
  std::map<std::int64_t, const Keyframe*> keyframe_of;
  for (const auto& entry : map.keyframes()) keyframe_of[entry.second.frame_index] = &entry.second;
  std::vector<ColmapImage> images;
  for (const PosedFrame& frame : trajectory) {
    ColmapImage image;
    image.name = names.at(frame.index);
    image.camera_from_map = frame.map_from_camera.inverse();
    const auto keyframe = keyframe_of.find(frame.index);
    if (keyframe != keyframe_of.end()) {
      const Keyframe& k = *keyframe->second;
      for (int f = 0; f < k.image->size(); ++f) {
        const LandmarkId l = k.landmark_of_feature[f];
        if (l == kNoLandmark) continue;
        const Eigen::Vector2d pixel = changed(k.image->set.features[f].pixel.cast<double>());
        // A pinhole has none of what is seen at a right angle and beyond.
        if (pixel.allFinite()) image.observations.push_back({pixel, index_of.at(l)});
      }
    }
    images.push_back(std::move(image));
  }
  write_colmap_text(folder, camera, images, points);
}

std::string doubt_of_names(const std::map<std::int64_t, std::string>& names) {
  const auto has_space = [](const auto& name) { return name.second.find(' ') != std::string::npos; };
  const auto first = std::find_if(names.begin(), names.end(), has_space);
  if (first == names.end()) return "";
  return std::to_string(std::count_if(first, names.end(), has_space)) +
         " images have a space in their names (the first: " + first->second +
         "), at which COLMAP ends a name as it reads a text model: for COLMAP, rename them";
}

}  // namespace mono_pose_tracker
