#include "splat_dataset.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "../json.h"
#include "io/colmap_binary.h"
#include "io/files.h"
#include "mono_pose_tracker/io/ply.h"

namespace mono_pose_tracker {

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
