#include "simulation/renderer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/threads.h"

namespace mono_pose_tracker {
namespace {

using Eigen::Vector3d;

constexpr int kTileSize = Renderer::kBandRows;  // px

/// Cosine of the slant up to which one sample does for a pixel: textures average over its footprint
/// themselves, which is as wide as long. Steeper surfaces are sampled as finely as edges.
constexpr double kFacing = 0.6;

cv::Vec3f to_bgr(const Color& color) { return {color.z(), color.y(), color.x()}; }

}  // namespace

/// What the ray of each pixel's centre meets (surface -1: nothing), and from where on each tile has to look.
struct Renderer::Geometry {
  struct Pixel {
    Hit hit;
    Vector3d normal_in_camera;
  };
  std::vector<Pixel> pixels;
  std::vector<double> tile_start;
};

/// Distance along `direction` to the plane that touches the surface where the pixel's ray met it; -1 without
/// one.
static double distance_to_plane(const Vector3d& direction, const Vector3d& pixel_ray, double pixel_distance,
                                const Vector3d& normal) {
  const double approach = normal.dot(direction);
  return approach < 0 ? pixel_distance * normal.dot(pixel_ray) / approach : -1;
}

Renderer::Renderer(const CameraModel& camera, int samples, int threads)
    : camera_(camera), samples_(samples), threads_(threads) {
  if (samples < 1 || samples > 8) {
    throw std::invalid_argument("samples = " + std::to_string(samples) + ", expected 1 to 8 per pixel side");
  }
  if (threads < 1)
    throw std::invalid_argument("threads = " + std::to_string(threads) + ", expected at least 1");
  make_rays();
  make_tiles();
}

void Renderer::make_rays() {
  const int width = camera_.width(), height = camera_.height(), per_pixel = samples_ * samples_;
  center_rays_.resize(static_cast<std::size_t>(width) * height);
  sample_rays_.resize(center_rays_.size() * per_pixel);
  parallel_for(height, threads_, [&](int row) {
    for (int column = 0; column < width; ++column) {
      const std::size_t pixel = static_cast<std::size_t>(row) * width + column;
      center_rays_[pixel] = camera_.bearing(Eigen::Vector2d(column, row));
      for (int k = 0; k < per_pixel; ++k) {
        const int across = k % samples_, down = k / samples_;
        const Eigen::Vector2d offset((across + 0.5) / samples_ - 0.5, (down + 0.5) / samples_ - 0.5);
        sample_rays_[pixel * per_pixel + k] =
            camera_.bearing(Eigen::Vector2d(column, row) + offset).cast<float>();
      }
    }
  });
}

void Renderer::make_tiles() {
  tile_columns_ = (camera_.width() + kTileSize - 1) / kTileSize;
  tile_rows_ = (camera_.height() + kTileSize - 1) / kTileSize;
  tiles_.resize(static_cast<std::size_t>(tile_columns_) * tile_rows_);
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    const int column0 = static_cast<int>(i) % tile_columns_ * kTileSize;
    const int row0 = static_cast<int>(i) / tile_columns_ * kTileSize;
    const int column1 = std::min(column0 + kTileSize, camera_.width());
    const int row1 = std::min(row0 + kTileSize, camera_.height());
    const Vector3d axis = center_ray((row0 + row1) / 2, (column0 + column1) / 2);
    double largest_angle = 0;
    for (int row = row0; row < row1; ++row) {
      for (int column = column0; column < column1; ++column) {
        for (int k = 0; k < samples_ * samples_; ++k) {
          const Vector3d ray = sample_ray(row, column, k);
          largest_angle = std::max(largest_angle, std::atan2(axis.cross(ray).norm(), axis.dot(ray)));
        }
      }
    }
    // An eighth to spare for rounding; no cone opens beyond 60 degrees, which no tile of a usable camera
    // does.
    tiles_[i] = {axis, std::tan(std::min(1.125 * largest_angle, 1.05))};
  }
}

Vector3d Renderer::center_ray(int row, int column) const {
  return center_rays_[static_cast<std::size_t>(row) * camera_.width() + column];
}

Vector3d Renderer::sample_ray(int row, int column, int sample) const {
  const std::size_t pixel = static_cast<std::size_t>(row) * camera_.width() + column;
  return sample_rays_[pixel * samples_ * samples_ + sample].cast<double>();
}

Renderer::Picture Renderer::render(const Scene& scene, const Rigid3& map_from_camera,
                                   const Lighting& lighting, const cv::Mat& background) const {
  return render(scene, std::vector<Rigid3>(bands(), map_from_camera), lighting, background);
}

Renderer::Picture Renderer::render(const Scene& scene, const std::vector<Rigid3>& map_from_camera_of_bands,
                                   const Lighting& lighting, const cv::Mat& background) const {
  const cv::Size size(camera_.width(), camera_.height());
  if (background.size() != size || background.type() != CV_32FC3) {
    throw std::invalid_argument("the background is not a CV_32FC3 image of the camera's size");
  }
  Geometry geometry;
  geometry.pixels.resize(center_rays_.size());
  geometry.tile_start.resize(tiles_.size());
  parallel_for(tile_rows_, threads_, [&](int tile_row) {
    cast_tile_row(scene, map_from_camera_of_bands.at(tile_row), tile_row, &geometry);
  });
  Picture picture{cv::Mat(size, CV_32FC3), cv::Mat(size, CV_8UC1)};
  parallel_for(size.height, threads_, [&](int row) {
    shade_row(scene, map_from_camera_of_bands[row / kBandRows], lighting, background, row, geometry,
              &picture);
  });
  return picture;
}

void Renderer::cast_tile_row(const Scene& scene, const Rigid3& map_from_camera, int tile_row,
                             Geometry* geometry) const {
  const Eigen::Matrix3d rotation = map_from_camera.rotation_matrix();
  for (int tile_column = 0; tile_column < tile_columns_; ++tile_column) {
    const std::size_t index = static_cast<std::size_t>(tile_row) * tile_columns_ + tile_column;
    const Tile& tile = tiles_[index];
    const double start =
        scene.free_distance({map_from_camera.translation, rotation * tile.axis_in_camera}, tile.slope);
    geometry->tile_start[index] = start;
    if (std::isinf(start)) continue;
    for (int row = tile_row * kTileSize; row < std::min((tile_row + 1) * kTileSize, camera_.height());
         ++row) {
      for (int column = tile_column * kTileSize;
           column < std::min((tile_column + 1) * kTileSize, camera_.width()); ++column) {
        const Ray ray{map_from_camera.translation, rotation * center_ray(row, column)};
        auto& pixel = geometry->pixels[static_cast<std::size_t>(row) * camera_.width() + column];
        if (scene.intersect(ray, start, &pixel.hit)) {
          pixel.normal_in_camera = rotation.transpose() * pixel.hit.normal_in_map;
        } else {
          pixel.hit.surface = -1;
        }
      }
    }
  }
}

/// Whether the plane through what this pixel's centre meets is, to half a pixel's size in depth, what its
/// neighbours meet too: then the samples between lie on that plane. On flat surfaces this is exact, on a head
/// it errs by micrometres.
bool Renderer::even_surface(const Geometry& geometry, int row, int column) const {
  const int width = camera_.width();
  const auto& pixel = geometry.pixels[static_cast<std::size_t>(row) * width + column];
  const double tolerance = 0.5 * pixel.hit.distance / camera_.focal();
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, camera_.height() - 1); ++r) {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, width - 1); ++c) {
      const Hit& neighbour = geometry.pixels[static_cast<std::size_t>(r) * width + c].hit;
      if (neighbour.surface != pixel.hit.surface) return false;
      if (neighbour.surface < 0) continue;
      const double expected = distance_to_plane(center_ray(r, c), center_ray(row, column), pixel.hit.distance,
                                                pixel.normal_in_camera);
      if (std::fabs(expected - neighbour.distance) > tolerance) return false;
    }
  }
  return true;
}

void Renderer::shade_row(const Scene& scene, const Rigid3& map_from_camera, const Lighting& lighting,
                         const cv::Mat& background, int row, const Geometry& geometry,
                         Picture* picture) const {
  for (int column = 0; column < camera_.width(); ++column) {
    const Hit& hit = geometry.pixels[static_cast<std::size_t>(row) * camera_.width() + column].hit;
    picture->mask.at<std::uint8_t>(row, column) = hit.surface >= 0 && scene.is_object(hit) ? 255 : 0;
    cv::Vec3f& color = picture->color.at<cv::Vec3f>(row, column);
    const cv::Vec3f& behind = background.at<cv::Vec3f>(row, column);
    if (!even_surface(geometry, row, column)) {
      color = shade_edge(scene, map_from_camera, lighting, behind, row, column, geometry);
    } else {
      color =
          hit.surface < 0 ? behind : shade_surface(scene, map_from_camera, lighting, row, column, geometry);
    }
  }
}

cv::Vec3f Renderer::shade_surface(const Scene& scene, const Rigid3& map_from_camera, const Lighting& lighting,
                                  int row, int column, const Geometry& geometry) const {
  const auto& pixel = geometry.pixels[static_cast<std::size_t>(row) * camera_.width() + column];
  const Vector3d center = center_ray(row, column);
  const Vector3d x_in_map = map_from_camera * Vector3d(pixel.hit.distance * center);
  const Color light = scene.irradiance(pixel.hit, x_in_map, lighting);
  const Color gloss = scene.gloss(pixel.hit, x_in_map, map_from_camera.rotation * -center, lighting);
  const double cosine = -pixel.normal_in_camera.dot(center);
  if (cosine > kFacing) {
    const float footprint = pixel_footprint(pixel.hit.distance, cosine);
    return to_bgr(light.cwiseProduct(scene.albedo(pixel.hit, x_in_map, footprint)) + gloss);
  }
  const float footprint = pixel_footprint(pixel.hit.distance, cosine) / samples_;
  const int count = samples_ * samples_;
  Color albedo = Color::Zero();
  for (int k = 0; k < count; ++k) {
    const Vector3d ray = sample_ray(row, column, k);
    const double distance = distance_to_plane(ray, center, pixel.hit.distance, pixel.normal_in_camera);
    albedo += scene.albedo(pixel.hit, map_from_camera * Vector3d(distance * ray), footprint);
  }
  return to_bgr(light.cwiseProduct(albedo / static_cast<float>(count)) + gloss);
}

cv::Vec3f Renderer::shade_edge(const Scene& scene, const Rigid3& map_from_camera, const Lighting& lighting,
                               const cv::Vec3f& behind, int row, int column, const Geometry& geometry) const {
  const double start = first_start(geometry, row, column);
  const int count = samples_ * samples_;
  cv::Vec3f sum(0, 0, 0);
  for (int k = 0; k < count; ++k) {
    const Ray ray{map_from_camera.translation, map_from_camera.rotation * sample_ray(row, column, k)};
    Hit hit;
    if (std::isinf(start) || !scene.intersect(ray, start, &hit)) {
      sum += behind;
      continue;
    }
    const Vector3d x_in_map = ray.origin + hit.distance * ray.direction;
    const float footprint = pixel_footprint(hit.distance, -hit.normal_in_map.dot(ray.direction)) / samples_;
    const Color light = scene.irradiance(hit, x_in_map, lighting);
    sum += to_bgr(light.cwiseProduct(scene.albedo(hit, x_in_map, footprint)) +
                  scene.gloss(hit, x_in_map, -ray.direction, lighting));
  }
  return sum / static_cast<float>(count);
}

double Renderer::first_start(const Geometry& geometry, int row, int column) const {
  return geometry.tile_start[static_cast<std::size_t>(row / kTileSize) * tile_columns_ + column / kTileSize];
}

float Renderer::pixel_footprint(double distance, double cosine) const {
  // Slanted surfaces stretch a pixel one way: the mean of the two sides, up to a slant where it is a smear
  // anyway.
  return static_cast<float>(distance / (camera_.focal() * std::sqrt(std::max(cosine, 0.05))));
}

}  // namespace mono_pose_tracker
