#include "colmap_model.h"

#include <algorithm>
#include <set>
#include <utility>

namespace mono_pose_tracker {

namespace {

/// Landmarks visible in an image, in pixels of the original image.
std::vector<LandmarkPixel> landmarks_of(const Keyframe& keyframe) {
  std::vector<LandmarkPixel> seen;
  for (int f = 0; f < keyframe.image->size(); ++f) {
    if (keyframe.landmark_of_feature[f] != kNoLandmark)
      seen.push_back({keyframe.landmark_of_feature[f], keyframe.image->set.features[f].pixel});
  }
  return seen;
}

class ModelBuilder {
 public:
  ModelBuilder(const CameraParameters& camera, const FinishedMap& map, const PixelChange& changed,
               const ColmapModelOptions& options)
      : camera_(camera), map_(map), changed_(changed), options_(options) {
    for (const auto& entry : map.map.keyframes()) keyframe_of_[entry.second.frame_index] = &entry.second;
  }

  void add(const RegisteredFrame& frame, const std::string& name) {
    images_.push_back({name, frame.map_from_camera.inverse(), {}});
    const auto keyframe = keyframe_of_.find(frame.index);
    const auto registered = map_.registered.find(frame.index);
    if (keyframe != keyframe_of_.end()) {
      seen_.push_back(landmarks_of(*keyframe->second));
    } else {
      seen_.push_back(registered == map_.registered.end() ? std::vector<LandmarkPixel>()
                                                          : still_in_map(*registered->second));
    }
  }

  ColmapModel finish() {
    std::set<LandmarkId> used;
    for (const std::vector<LandmarkPixel>& seen : seen_) {
      for (const LandmarkPixel& s : seen) used.insert(s.landmark);
    }
    // Of a loaded map, what only earlier runs have seen has no image here.
    std::vector<ColmapPoint> points;
    std::map<LandmarkId, int> index_of;
    for (const LandmarkId id : used) {
      index_of[id] = static_cast<int>(points.size());
      points.push_back(point(id));
    }
    for (std::size_t i = 0; i < images_.size(); ++i) {
      for (const LandmarkPixel& s : seen_[i]) {
        const Eigen::Vector2d pixel = changed_(s.pixel.cast<double>());
        // A pinhole has none of what is seen at a right angle and beyond.
        if (pixel.allFinite()) images_[i].observations.push_back({pixel, index_of.at(s.landmark)});
      }
    }
    return {std::move(images_), std::move(points)};
  }

 private:
  /// Landmarks are culled and moved after registration.
  std::vector<LandmarkPixel> still_in_map(const std::vector<LandmarkPixel>& registered) const {
    const Rigid3& camera_from_map = images_.back().camera_from_map;
    std::vector<LandmarkPixel> seen;
    std::set<LandmarkId> known;
    for (const LandmarkPixel& s : registered) {
      const Landmark* landmark = map_.map.landmark(s.landmark);
      Eigen::Vector2d projected;
      if (!landmark || landmark->observations.empty() ||
          !camera_.project(camera_from_map * landmark->x_in_map, &projected))
        continue;
      const bool fits = (projected - changed_(s.pixel.cast<double>())).norm() <= options_.max_error_px;
      if (fits && known.insert(s.landmark).second) seen.push_back(s);
    }
    return seen;
  }

  ColmapPoint point(LandmarkId id) const {
    const Landmark& landmark = *map_.map.landmark(id);
    ColmapPoint point;
    point.x_in_map = landmark.x_in_map;
    for (const Observation& o : landmark.observations) {
      const Keyframe& keyframe = *map_.map.keyframe(o.keyframe);
      point.error_px +=
          reprojection_error(*keyframe.image, o.feature, keyframe.camera_from_map * landmark.x_in_map)
              .norm() /
          landmark.observations.size();
    }
    const Observation& first = landmark.observations.front();
    const cv::Vec3b& rgb = map_.map.keyframe(first.keyframe)->image->color_rgb[first.feature];
    point.r = rgb[0], point.g = rgb[1], point.b = rgb[2];
    return point;
  }

  const CameraModel camera_;
  const FinishedMap& map_;
  const PixelChange& changed_;
  const ColmapModelOptions options_;
  std::map<std::int64_t, const Keyframe*> keyframe_of_;
  std::vector<ColmapImage> images_;
  std::vector<std::vector<LandmarkPixel>> seen_;  // of each image
};

}  // namespace

ColmapModel colmap_model_of(const CameraParameters& camera, const FinishedMap& map,
                            const std::vector<RegisteredFrame>& trajectory,
                            const std::map<std::int64_t, std::string>& names, const PixelChange& changed,
                            const ColmapModelOptions& options) {
  ModelBuilder model(camera, map, changed, options);
  for (const RegisteredFrame& frame : trajectory) model.add(frame, names.at(frame.index));
  return model.finish();
}

void write_map_for_colmap(const std::string& folder, const CameraParameters& camera, const FinishedMap& map,
                          const std::vector<RegisteredFrame>& trajectory,
                          const std::map<std::int64_t, std::string>& names, const PixelChange& changed,
                          const ColmapModelOptions& options) {
  const ColmapModel model = colmap_model_of(camera, map, trajectory, names, changed, options);
  write_colmap_text(folder, camera, model.images, model.points);
}

std::string doubt_of_names(const std::map<std::int64_t, std::string>& names) {
  const auto has_space = [](const auto& name) { return name.second.find(' ') != std::string::npos; };
  const auto first = std::find_if(names.begin(), names.end(), has_space);
  if (first == names.end()) return "";
  return std::to_string(std::count_if(first, names.end(), has_space)) +
         " images have a space in their names (the first: " + first->second +
         "), but COLMAP's text model does not support spaces in names: rename the images for COLMAP";
}

}  // namespace mono_pose_tracker
