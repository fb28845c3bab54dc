#include "mono_pose_tracker/io/overview.h"

#include <opencv2/imgproc.hpp>

#include "mono_pose_tracker/io/plot.h"

namespace mono_pose_tracker {
namespace {

const cv::Scalar kRed(40, 40, 215), kGreen(30, 140, 20), kBlue(215, 110, 30);

// Shares of the points that the view may cut at either end of an axis: the far background and what is badly
// triangulated.
constexpr double kFarPoints = 0.03;

std::vector<Eigen::Vector3d> positions(const std::vector<ColoredPoint>& points) {
  std::vector<Eigen::Vector3d> result;
  for (const ColoredPoint& point : points) result.push_back(point.x_in_map.cast<double>());
  return result;
}

/// Picks two coordinates, each with a sign.
struct View {
  const char *title, *x_label, *y_label;
  int x_axis, y_axis;
  double y_sign;

  std::vector<Eigen::Vector2d> operator()(const std::vector<Eigen::Vector3d>& points) const {
    std::vector<Eigen::Vector2d> result;
    for (const Eigen::Vector3d& p : points) result.emplace_back(p[x_axis], y_sign * p[y_axis]);
    return result;
  }
};

PlotRange view_range(const PlotPanel& panel, int axis) {
  std::vector<double> points, cameras;
  for (std::size_t i = 0; i < panel.series.size(); ++i) {
    for (const Eigen::Vector2d& p : panel.series[i].points) (i == 0 ? points : cameras).push_back(p[axis]);
  }
  const PlotRange camera_range = range_of(cameras), point_range = range_of(points, kFarPoints, kFarPoints);
  if (points.empty()) return with_margin(camera_range, 0.05);
  return with_margin(cameras.empty() ? point_range : united(point_range, camera_range), 0.05);
}

PlotPanel make_panel(const Overview& overview, const View& view) {
  PlotPanel panel;
  panel.title = view.title;
  panel.x_label = view.x_label;
  panel.y_label = view.y_label;
  panel.equal_axes = true;
  panel.series = {{"points", view(positions(overview.points)), kRed, 1, 0},
                  {"true camera positions", view(overview.true_cameras), kBlue, 2.5, 2},
                  {"camera positions", view(overview.cameras), kGreen, 3.5, 0}};
  panel.x = view_range(panel, 0);
  panel.y = view_range(panel, 1);
  return panel;
}

}  // namespace

cv::Mat draw_overview(const Overview& overview) {
  const View above = {"from above", "x, to the right (map units)", "z, forward", 0, 2, 1};
  const View side = {"from the side", "z, forward (map units)", "-y, up", 2, 1, -1};
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
