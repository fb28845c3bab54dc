#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/rigid3.h"
#include "simulation/scene.h"

namespace mono_pose_tracker {

/// Casts rays through the pixels of a camera. A pixel is the mean over its square, taken by samples^2 samples
/// spread evenly wherever edges or a steep slant need them, so the image is symmetric about the pixel centres
/// that the ground truth is exact for. Const after construction: may be shared between threads. The result
/// does not depend on the number of threads.
class Renderer {
 public:
  /// `samples` per pixel side, 1 to 8; `threads` >= 1.
  Renderer(const CameraModel& camera, int samples, int threads);

  struct Picture {
    cv::Mat color;  // CV_32FC3, blue green red, [0, 1]
    cv::Mat mask;   // CV_8UC1, 255 where the ray of the pixel's centre meets the object (Scene::is_object)
  };

  /// `background` (as color, of the image's size) shows where no ray meets the scene.
  Picture render(const Scene& scene, const Rigid3& map_from_camera, const Lighting& lighting,
                 const cv::Mat& background) const;

  /// Rows that are seen from one place when they are not all: from the top, the last band may have fewer.
  static constexpr int kBandRows = 8;
  int bands() const { return tile_rows_; }
  /// The camera moves while the image is taken: a pose for each band.
  Picture render(const Scene& scene, const std::vector<Rigid3>& map_from_camera_of_bands,
                 const Lighting& lighting, const cv::Mat& background) const;

 private:
  struct Tile {
    Eigen::Vector3d axis_in_camera;
    double slope;  // tangent of the angle between the axis and the farthest sample
  };
  struct Geometry;

  void make_rays();
  void make_tiles();
  void cast_tile_row(const Scene& scene, const Rigid3& map_from_camera, int tile_row,
                     Geometry* geometry) const;
  void shade_row(const Scene& scene, const Rigid3& map_from_camera, const Lighting& lighting,
                 const cv::Mat& background, int row, const Geometry& geometry, Picture* picture) const;
  cv::Vec3f shade_surface(const Scene& scene, const Rigid3& map_from_camera, const Lighting& lighting,
                          int row, int column, const Geometry& geometry) const;
  cv::Vec3f shade_edge(const Scene& scene, const Rigid3& map_from_camera, const Lighting& lighting,
                       const cv::Vec3f& behind, int row, int column, const Geometry& geometry) const;
  double first_start(const Geometry& geometry, int row, int column) const;
  float pixel_footprint(double distance, double cosine) const;
  bool even_surface(const Geometry& geometry, int row, int column) const;
  Eigen::Vector3d center_ray(int row, int column) const;
  Eigen::Vector3d sample_ray(int row, int column, int sample) const;

  CameraModel camera_;
  int samples_, threads_;
  std::vector<Eigen::Vector3d> center_rays_;  // unit bearings of the pixels, row by row
  std::vector<Eigen::Vector3f> sample_rays_;  // and of their samples, samples^2 a pixel
  int tile_columns_ = 0, tile_rows_ = 0;
  std::vector<Tile> tiles_;
};

}  // namespace mono_pose_tracker
