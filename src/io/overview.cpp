#include "io/overview.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "io/plot.h"

namespace mono_pose_tracker {
namespace {

const cv::Scalar kBlack(0, 0, 0), kStart(60, 160, 20), kEnd(30, 30, 200), kPath(160, 60, 110),
    kGrey(130, 130, 130);

// Grey level above which a point's colour is darkened: it must be seen on white.
constexpr double kBrightest = 190;

// Shares of the points that the view may cut at either end of an axis: the far background and what is badly
// triangulated.
constexpr double kFarPoints = 0.03;

std::vector<Eigen::Vector3d> positions(const std::vector<ColoredPoint>& points) {
  std::vector<Eigen::Vector3d> result;
  result.reserve(points.size());
  for (const ColoredPoint& point : points) result.push_back(point.x_in_map.cast<double>());
  return result;
}

std::vector<cv::Scalar> own_colors(const std::vector<ColoredPoint>& points) {
  std::vector<cv::Scalar> colors;
  for (const ColoredPoint& point : points) {
    const double brightness = 0.114 * point.b + 0.587 * point.g + 0.299 * point.r;
    colors.push_back(cv::Scalar(point.b, point.g, point.r) *
                     (brightness > kBrightest ? kBrightest / brightness : 1));
  }
  return colors;
}

/// From blue (old) to red (new), as rviz shows them.
std::vector<cv::Scalar> colors_by_time(std::size_t count) {
  std::vector<cv::Scalar> colors;
  for (std::size_t i = 0; i < count; ++i) {
    const double age = count > 1 ? 1 - static_cast<double>(i) / static_cast<double>(count - 1) : 1;
    colors.emplace_back(255 * age, 80, 255 * (1 - age));
  }
  return colors;
}

/// Across y, the direction in which points and cameras spread most, coordinate by coordinate without the
/// farthest points; so that what is ahead (or else to the right) of the first camera lies to the right.
Eigen::Vector3d longest_direction(const Overview& overview) {
  std::vector<Eigen::Vector3d> all = positions(overview.points);
  std::array<PlotRange, 3> kept;
  for (const int axis : {0, 2}) {
    std::vector<double> values;
    values.reserve(all.size());
    for (const Eigen::Vector3d& p : all) values.push_back(p[axis]);
    kept[axis] = range_of(values, kFarPoints, kFarPoints);
  }
  const auto is_far = [&](const Eigen::Vector3d& p) {
    return !p.allFinite() || p.x() < kept[0].low || p.x() > kept[0].high || p.z() < kept[2].low ||
           p.z() > kept[2].high;
  };
  all.erase(std::remove_if(all.begin(), all.end(), is_far), all.end());
  std::copy_if(overview.cameras.begin(), overview.cameras.end(), std::back_inserter(all),
               [](const Eigen::Vector3d& camera) { return camera.allFinite(); });
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector3d& p : all)
    mean += Eigen::Vector2d(p.x(), p.z()) / static_cast<double>(all.size());
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector3d& p : all) {
    const Eigen::Vector2d d = Eigen::Vector2d(p.x(), p.z()) - mean;
    spread += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(spread);
  // Equal spread in all directions (or no spread): along z, as from the first camera's side.
  if (!(solver.eigenvalues()[1] > 1.05 * solver.eigenvalues()[0])) return Eigen::Vector3d::UnitZ();
  const Eigen::Vector2d longest = solver.eigenvectors().col(1);
  const Eigen::Vector3d direction(longest.x(), 0, longest.y());
  const double ahead = std::abs(direction.z()) > 0.1 ? direction.z() : direction.x();
  return ahead < 0 ? Eigen::Vector3d(-direction) : direction;
}

/// Projects onto two directions.
struct View {
  const char *title, *x_label, *y_label;
  Eigen::Vector3d right, up;

  std::vector<Eigen::Vector2d> operator()(const std::vector<Eigen::Vector3d>& points) const {
    std::vector<Eigen::Vector2d> result;
    result.reserve(points.size());
    for (const Eigen::Vector3d& p : points) result.emplace_back(right.dot(p), up.dot(p));
    return result;
  }
};

// Radius around the camera's path that the picture covers: the near scene, not a skyline, against which the
// path would be a dot. Distances are from each point to the nearest of some cameras. The radius is 1.5 times
// their median; if more than half of all points are farther away than the path is long, it is based on the
// nearest quarter (or on the path's length, if larger).
double reach_of(const Overview& overview) {
  constexpr std::size_t kMaxCameras = 100, kMaxPoints = 5000;
  const auto step = [](std::size_t size, std::size_t most) { return std::max<std::size_t>(1, size / most); };
  std::vector<double> distances;
  for (std::size_t i = 0; i < overview.points.size(); i += step(overview.points.size(), kMaxPoints)) {
    const Eigen::Vector3d p = overview.points[i].x_in_map.cast<double>();
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < overview.cameras.size(); c += step(overview.cameras.size(), kMaxCameras)) {
      nearest = std::min(nearest, (p - overview.cameras[c]).norm());
    }
    distances.push_back(nearest);
  }
  if (overview.cameras.empty() || distances.empty()) return std::numeric_limits<double>::infinity();
  double way = 0;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector3d& camera : overview.cameras) values.push_back(camera[axis]);
    const PlotRange range = range_of(std::move(values));
    way = std::max(way, range.high - range.low);
  }
  const double near_quarter = range_of(distances, 0.25).low, half = range_of(distances, 0.5).low;
  return 1.5 * std::min(half, std::max(near_quarter, way));
}

PlotRange view_range(const PlotPanel& panel, int axis, double reach) {
  std::vector<double> points, cameras;
  for (std::size_t i = 0; i < panel.series.size(); ++i) {
    for (const Eigen::Vector2d& p : panel.series[i].points) (i == 0 ? points : cameras).push_back(p[axis]);
  }
  const PlotRange camera_range = range_of(cameras), point_range = range_of(points, kFarPoints, kFarPoints);
  if (points.empty()) return with_margin(camera_range, 0.05);
  if (cameras.empty()) return with_margin(point_range, 0.05);
  const PlotRange near = {std::max(point_range.low, camera_range.low - reach),
                          std::min(point_range.high, camera_range.high + reach)};
  return with_margin(united(near, camera_range), 0.05);
}

PlotPanel make_panel(const Overview& overview, const View& view) {
  PlotPanel panel;
  panel.title = view.title;
  panel.x_label = std::string(view.x_label) + " (" + overview.unit + ")";
  panel.y_label = view.y_label;
  panel.equal_axes = true;
  const std::vector<Eigen::Vector2d> path = view(overview.cameras);
  PlotSeries points = {"points", view(positions(overview.points)), kGrey, 1, 0};
  points.colors = own_colors(overview.points);
  PlotSeries cameras = {"camera, blue to red by time", path, kPath, 2, 1};
  cameras.colors = colors_by_time(path.size());
  PlotSeries start = {"start", {}, kStart, 6, 0}, end = {"end", {}, kEnd, 6, 0, true};
  if (!path.empty()) start.points = {path.front()}, end.points = {path.back()};
  panel.series = {points, {"true path", view(overview.true_cameras), kBlack, 0, 6}, cameras, end, start};
  const double reach = reach_of(overview);
  panel.x = view_range(panel, 0, reach);
  panel.y = view_range(panel, 1, reach);
  return panel;
}

}  // namespace

cv::Mat draw_overview(const Overview& overview) {
  using Eigen::Vector3d;
  const View above = {"from above", "x, to the right", "z, forward", Vector3d::UnitX(), Vector3d::UnitZ()};
  const View side = {"from the side", "along the longest direction", "-y, up", longest_direction(overview),
                     -Vector3d::UnitY()};
  const int size = 800, header = overview.title.empty() ? 0 : 44;
  cv::Mat picture(size + header, 2 * size, CV_8UC3, cv::Scalar::all(255));
  draw_panel(make_panel(overview, above), {0, header, size, size}, &picture);
  draw_panel(make_panel(overview, side), {size, header, size, size}, &picture);
  if (header > 0) {
    cv::putText(picture, overview.title, {20, 32}, cv::FONT_HERSHEY_SIMPLEX, 0.9, cv::Scalar::all(20), 2,
                cv::LINE_AA);
  }
  return picture;
}

void write_overview(const std::string& path, const Overview& overview) {
  write_picture(path, draw_overview(overview));
}

}  // namespace mono_pose_tracker
