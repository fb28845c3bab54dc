#include "model_export.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <utility>

#include "../json.h"
#include "io/colmap_binary.h"
#include "io/files.h"
#include "mono_pose_tracker/io/ply.h"

namespace mono_pose_tracker {
namespace {

/// Landmarks visible in an image, in pixels of the original image.
std::vector<LandmarkPixel> observed_landmarks(const Keyframe& keyframe) {
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
      seen_.push_back(observed_landmarks(*keyframe->second));
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

namespace {

namespace fs = std::filesystem;

constexpr const char* kPointsFile = "sparse_pc.ply";
constexpr int kMaxAabbScale = 128;  // of instant-ngp

/// The value below which `share` of the values lie. Empty input: 0.
double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto last = static_cast<double>(values.size() - 1);
  const auto at = static_cast<std::ptrdiff_t>(std::lround(share * last));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

Eigen::Vector3d median_of(const std::vector<Eigen::Vector3d>& positions) {
  Eigen::Vector3d median = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector3d& x : positions) values.push_back(x[axis]);
    median[axis] = quantile(std::move(values), 0.5);
  }
  return median;
}

Json rows_of(const Eigen::Matrix4d& matrix, int rows) {
  Json json = Json::array();
  for (int r = 0; r < rows; ++r) {
    json.push_back({matrix(r, 0), matrix(r, 1), matrix(r, 2), matrix(r, 3)});
  }
  return json;
}

/// map_from_camera of a camera with OpenGL's axes: x right, y up, z backwards.
Eigen::Matrix4d opengl_pose(const Rigid3& map_from_camera) {
  Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
  pose.topLeftCorner<3, 3>() = map_from_camera.rotation.toRotationMatrix();
  pose.col(1) = -pose.col(1);
  pose.col(2) = -pose.col(2);
  pose.topRightCorner<3, 1>() = map_from_camera.translation;
  return pose;
}

// The centre of the first pixel is (0.5, 0.5) for nerfstudio and instant-ngp, as for COLMAP.
Json camera_json(const CameraParameters& camera) {
  return {{"camera_model", "PINHOLE"},
          {"w", camera.width},
          {"h", camera.height},
          {"fl_x", camera.fx},
          {"fl_y", camera.fy},
          {"cx", camera.cx + 0.5},
          {"cy", camera.cy + 0.5},
          {"camera_angle_x", 2 * std::atan(camera.width / (2 * camera.fx))},
          {"camera_angle_y", 2 * std::atan(camera.height / (2 * camera.fy))},
          {"k1", 0},
          {"k2", 0},
          {"p1", 0},
          {"p2", 0}};
}

// applied_transform is the identity: some releases of nerfstudio apply it to the points of ply_file_path as
// well as to the poses and some do not. The identity is right for all.
Json transforms_json(const CameraParameters& camera, const std::vector<ColmapImage>& images,
                     const NgpBox& box) {
  Json json = camera_json(camera);
  json["aabb_scale"] = box.aabb_scale;
  json["scale"] = box.scale;
  json["offset"] = {box.offset.x(), box.offset.y(), box.offset.z()};
  json["applied_transform"] = rows_of(Eigen::Matrix4d::Identity(), 3);
  json["ply_file_path"] = kPointsFile;
  Json frames = Json::array();
  for (std::size_t i = 0; i < images.size(); ++i) {
    frames.push_back({{"file_path", "images/" + images[i].name},
                      {"mask_path", "masks/" + images[i].name + ".png"},
                      {"colmap_im_id", i + 1},
                      {"transform_matrix", rows_of(opengl_pose(images[i].camera_from_map.inverse()), 4)}});
  }
  json["frames"] = std::move(frames);
  return json;
}

std::vector<ColoredPoint> ply_points(const std::vector<ColmapPoint>& points) {
  std::vector<ColoredPoint> colored;
  colored.reserve(points.size());
  for (const ColmapPoint& point : points) {
    ColoredPoint c;
    c.x_in_map = point.x_in_map.cast<float>();
    c.r = point.r, c.g = point.g, c.b = point.b;
    colored.push_back(c);
  }
  return colored;
}

}  // namespace

NgpBox ngp_box(const std::vector<ColmapImage>& images, const std::vector<ColmapPoint>& points,
               const SplatDatasetOptions& options) {
  std::vector<Eigen::Vector3d> cameras, positions;
  for (const ColmapImage& image : images) cameras.push_back(image.camera_from_map.inverse().translation);
  for (const ColmapPoint& point : points) positions.push_back(point.x_in_map);
  const Eigen::Vector3d centre = median_of(positions.empty() ? cameras : positions);
  const auto half_sides = [&](const std::vector<Eigen::Vector3d>& all) {
    std::vector<double> sides;
    for (const Eigen::Vector3d& x : all) sides.push_back((x - centre).lpNorm<Eigen::Infinity>());
    return sides;
  };
  const double inner = quantile(half_sides(positions.empty() ? cameras : positions), options.unit_cube_share);
  const double outer =
      std::max(quantile(half_sides(positions), options.box_share), quantile(half_sides(cameras), 1));
  NgpBox box;
  box.scale = inner > 0 ? 0.5 / inner : 1;
  box.offset = Eigen::Vector3d::Constant(0.5) - box.scale * centre;
  while (box.aabb_scale < kMaxAabbScale && 0.5 * box.aabb_scale < box.scale * outer) box.aabb_scale *= 2;
  return box;
}

void write_splat_dataset(const std::string& folder, const CameraParameters& camera,
                         const std::vector<ColmapImage>& images, const std::vector<ColmapPoint>& points,
                         const SplatDatasetOptions& options) {
  const fs::path path(folder);
  const std::string model = (path / "sparse" / "0").string();
  write_colmap_text(model, camera, images, points);
  write_colmap_binary(model, camera, images, points);
  write_ply((path / kPointsFile).string(), ply_points(points));
  const Json json = transforms_json(camera, images, ngp_box(images, points, options));
  write_file_atomically((path / "transforms.json").string(), [&](std::ostream& out) {
    out << json.dump(1, ' ', false, Json::error_handler_t::replace) << '\n';
  });
}

}  // namespace mono_pose_tracker
