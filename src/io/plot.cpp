#include "io/plot.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <utility>

#include "common/text.h"
#include "io/image_coding.h"

namespace mono_pose_tracker {
namespace {

const cv::Scalar kInk(40, 40, 40), kGrid(225, 225, 225), kFrame(120, 120, 120);
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kTitleSize = 0.75, kTextSize = 0.5;
// Room around the diagram in px: for the y scale, the title and legend, the x scale and its label.
constexpr int kLeft = 75, kTop = 80, kRight = 20, kBottom = 55;

enum class Align { kLeft, kCentre, kRight };

/// The size at which a text is no wider than that; `size` where it is narrower.
double size_within(int width_px, const std::string& text, double size) {
  int baseline = 0;
  const int width = cv::getTextSize(text, kFont, size, 1, &baseline).width;
  return width > width_px ? size * width_px / width : size;
}

void draw_text(const std::string& text, cv::Point at, double size, Align align, cv::Mat* picture) {
  int baseline = 0;
  const int width = cv::getTextSize(text, kFont, size, 1, &baseline).width;
  if (align == Align::kCentre) at.x -= width / 2;
  if (align == Align::kRight) at.x -= width;
  cv::putText(*picture, text, at, kFont, size, kInk, 1, cv::LINE_AA);
}

/// 1, 2 or 5 times a power of ten: about `count` steps in the range.
double tick_step(const PlotRange& range, int count) {
  const double raw = (range.high - range.low) / count;
  const double power = std::pow(10, std::floor(std::log10(raw)));
  for (double factor : {1.0, 2.0, 5.0}) {
    if (raw <= factor * power) return factor * power;
  }
  return 10 * power;
}

/// The multiples of the step in the range.
std::vector<double> ticks(const PlotRange& range, double step) {
  const double first = std::ceil(range.low / step) * step;
  const int count = 1 + static_cast<int>(std::floor((range.high - first) / step + 1e-9));  // despite rounding
  std::vector<double> values(std::max(count, 0));
  for (int i = 0; i < count; ++i) values[i] = first + i * step;
  return values;
}

std::string tick_label(double value, double step) {
  return formatted("%.6g", std::abs(value) < 1e-6 * step ? 0.0 : value);
}

/// Places the ranges on a rectangle of pixels.
class Axes {
 public:
  Axes(const PlotPanel& panel, const cv::Rect& box) : x_(panel.x), y_(panel.y), box_(box) {
    if (!panel.equal_axes) return;
    const double units_per_px = std::max((x_.high - x_.low) / box.width, (y_.high - y_.low) / box.height);
    x_ = of_length(x_, units_per_px * box.width);
    y_ = of_length(y_, units_per_px * box.height);
  }

  double x_px(double x) const {
    return (x - x_.low) / (x_.high - x_.low) * box_.width;
  }  // from the box's left
  double y_px(double y) const { return (y_.high - y) / (y_.high - y_.low) * box_.height; }

  void draw_scale(cv::Mat* picture) const {
    const double x_step = tick_step(x_, box_.width / 90), y_step = tick_step(y_, box_.height / 60);
    for (const double x : ticks(x_, x_step)) {
      const int px = box_.x + cvRound(x_px(x));
      cv::line(*picture, {px, box_.y}, {px, box_.y + box_.height}, kGrid, 1);
      draw_text(tick_label(x, x_step), {px, box_.y + box_.height + 20}, kTextSize, Align::kCentre, picture);
    }
    for (const double y : ticks(y_, y_step)) {
      const int py = box_.y + cvRound(y_px(y));
      cv::line(*picture, {box_.x, py}, {box_.x + box_.width, py}, kGrid, 1);
      draw_text(tick_label(y, y_step), {box_.x - 8, py + 5}, kTextSize, Align::kRight, picture);
    }
  }

 private:
  static PlotRange of_length(const PlotRange& range, double length) {
    const double centre = 0.5 * (range.low + range.high);
    return {centre - 0.5 * length, centre + 0.5 * length};
  }

  PlotRange x_, y_;
  cv::Rect box_;
};

constexpr int kSubpixelBits = 4;

cv::Point to_subpixels(double x, double y) {
  // Far outside is outside: kept within what OpenCV's integers can draw.
  const double limit = 30000;
  return {cvRound(std::clamp(x, -limit, limit) * (1 << kSubpixelBits)),
          cvRound(std::clamp(y, -limit, limit) * (1 << kSubpixelBits))};
}

/// A point of a series on the picture.
struct Dot {
  cv::Point at;  // in subpixels
  cv::Scalar color;
  bool is_joined = false;  // with the one before
};

void draw_mark(const Dot& dot, const PlotSeries& series, cv::Mat* box) {
  const int radius = cvRound(series.radius_px * (1 << kSubpixelBits));
  if (series.is_square) {
    const cv::Point corner(radius, radius);
    cv::rectangle(*box, dot.at - corner, dot.at + corner, dot.color, cv::FILLED, cv::LINE_AA, kSubpixelBits);
  } else {
    cv::circle(*box, dot.at, radius, dot.color, cv::FILLED, cv::LINE_AA, kSubpixelBits);
  }
}

void draw_series(const PlotSeries& series, const Axes& axes, cv::Mat* box) {
  std::vector<Dot> dots;
  bool is_joined = false;
  for (std::size_t i = 0; i < series.points.size(); ++i) {
    const Eigen::Vector2d& point = series.points[i];
    const bool was_joined = std::exchange(is_joined, point.allFinite());
    if (!is_joined) continue;
    dots.push_back({to_subpixels(axes.x_px(point.x()), axes.y_px(point.y())),
                    series.colors.empty() ? series.color : series.colors[i], was_joined});
  }
  for (std::size_t i = 1; i < dots.size() && series.line_px > 0; ++i) {
    if (!dots[i].is_joined) continue;
    cv::line(*box, dots[i - 1].at, dots[i].at, dots[i - 1].color, series.line_px, cv::LINE_AA, kSubpixelBits);
  }
  if (series.radius_px <= 0) return;
  const cv::Rect visible(-64, -64, (box->cols + 8) << kSubpixelBits, (box->rows + 8) << kSubpixelBits);
  for (const Dot& dot : dots) {
    if (visible.contains(dot.at)) draw_mark(dot, series, box);
  }
}

void draw_legend(const PlotPanel& panel, cv::Point at, cv::Mat* picture) {
  for (const PlotSeries& series : panel.series) {
    if (series.name.empty() || series.points.empty()) continue;
    if (series.is_square) {
      cv::rectangle(*picture, {at.x + 1, at.y - 10}, {at.x + 11, at.y}, series.color, cv::FILLED);
    } else {
      cv::circle(*picture, {at.x + 6, at.y - 5}, 5, series.color, cv::FILLED, cv::LINE_AA);
    }
    draw_text(series.name, {at.x + 18, at.y}, kTextSize, Align::kLeft, picture);
    int baseline = 0;
    at.x += 18 + cv::getTextSize(series.name, kFont, kTextSize, 1, &baseline).width + 24;
  }
}

}  // namespace

PlotRange range_of(std::vector<double> values, double share_below, double share_above) {
  values.erase(std::remove_if(values.begin(), values.end(), [](double v) { return !std::isfinite(v); }),
               values.end());
  if (values.empty()) return {};
  const auto quantile = [&values](double share) {
    const auto at = values.begin() + std::lround(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
  };
  const double low = quantile(share_below);
  return {low, quantile(1 - share_above)};
}

PlotRange united(const PlotRange& a, const PlotRange& b) {
  return {std::min(a.low, b.low), std::max(a.high, b.high)};
}

PlotRange with_margin(const PlotRange& range, double share) {
  const double size = std::max(std::abs(range.low), std::abs(range.high));
  double margin = share * (range.high - range.low);
  if (!(margin > 1e-9 * size)) margin = size > 0 ? 0.1 * size : 1;
  return {range.low - margin, range.high + margin};
}

void draw_panel(const PlotPanel& panel, const cv::Rect& area, cv::Mat* picture) {
  const cv::Rect box(area.x + kLeft, area.y + kTop, area.width - kLeft - kRight,
                     area.height - kTop - kBottom);
  cv::rectangle(*picture, area, cv::Scalar::all(255), cv::FILLED);
  const Axes axes(panel, box);
  axes.draw_scale(picture);
  cv::Mat inside = (*picture)(box);
  for (const PlotSeries& series : panel.series) draw_series(series, axes, &inside);
  cv::rectangle(*picture, box, kFrame, 1);
  draw_text(panel.title, {box.x, area.y + 28}, size_within(box.width, panel.title, kTitleSize), Align::kLeft,
            picture);
  draw_legend(panel, {box.x, area.y + 52}, picture);
  draw_text(panel.y_label, {area.x + 8, box.y - 10}, kTextSize, Align::kLeft, picture);
  draw_text(panel.x_label, {box.x + box.width, area.y + area.height - 12}, kTextSize, Align::kRight, picture);
}

void write_picture(const std::string& path, const cv::Mat& picture) {
  if (!write_image_as_named(path, picture))
    throw std::runtime_error(
        path + ": cannot be written as an image: expected a file name that ends in .png or .jpg");
}

namespace {

const cv::Scalar kBlack(0, 0, 0), kStart(60, 160, 20), kEnd(30, 30, 200), kPath(160, 60, 110),
    kGrey(130, 130, 130);

std::vector<Eigen::Vector3d> positions(const std::vector<ColoredPoint>& points) {
  std::vector<Eigen::Vector3d> result;
  result.reserve(points.size());
  for (const ColoredPoint& point : points) result.push_back(point.x_in_map.cast<double>());
  return result;
}

std::vector<cv::Scalar> own_colors(const std::vector<ColoredPoint>& points, double brightest) {
  std::vector<cv::Scalar> colors;
  for (const ColoredPoint& point : points) {
    const double brightness = 0.114 * point.b + 0.587 * point.g + 0.299 * point.r;
    colors.push_back(cv::Scalar(point.b, point.g, point.r) *
                     (brightness > brightest ? brightest / brightness : 1));
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
Eigen::Vector3d longest_direction(const Overview& overview, double far_points) {
  std::vector<Eigen::Vector3d> all = positions(overview.points);
  std::array<PlotRange, 3> kept;
  for (const int axis : {0, 2}) {
    std::vector<double> values;
    values.reserve(all.size());
    for (const Eigen::Vector3d& p : all) values.push_back(p[axis]);
    kept[axis] = range_of(values, far_points, far_points);
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
double reach_of(const Overview& overview, const OverviewOptions& options) {
  const auto step = [](std::size_t size, std::size_t most) { return std::max<std::size_t>(1, size / most); };
  std::vector<double> distances;
  for (std::size_t i = 0; i < overview.points.size(); i += step(overview.points.size(), options.max_points)) {
    const Eigen::Vector3d p = overview.points[i].x_in_map.cast<double>();
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < overview.cameras.size();
         c += step(overview.cameras.size(), options.max_cameras)) {
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

PlotRange view_range(const PlotPanel& panel, int axis, double reach, double far_points) {
  std::vector<double> points, cameras;
  for (std::size_t i = 0; i < panel.series.size(); ++i) {
    for (const Eigen::Vector2d& p : panel.series[i].points) (i == 0 ? points : cameras).push_back(p[axis]);
  }
  const PlotRange camera_range = range_of(cameras), point_range = range_of(points, far_points, far_points);
  if (points.empty()) return with_margin(camera_range, 0.05);
  if (cameras.empty()) return with_margin(point_range, 0.05);
  const PlotRange near = {std::max(point_range.low, camera_range.low - reach),
                          std::min(point_range.high, camera_range.high + reach)};
  return with_margin(united(near, camera_range), 0.05);
}

PlotPanel make_panel(const Overview& overview, const View& view, const OverviewOptions& options) {
  PlotPanel panel;
  panel.title = view.title;
  panel.x_label = std::string(view.x_label) + " (" + overview.unit + ")";
  panel.y_label = view.y_label;
  panel.equal_axes = true;
  const std::vector<Eigen::Vector2d> path = view(overview.cameras);
  PlotSeries points = {"points", view(positions(overview.points)), kGrey, 1, 0};
  points.colors = own_colors(overview.points, options.brightest);
  PlotSeries cameras = {"camera, blue to red by time", path, kPath, 2, 1};
  cameras.colors = colors_by_time(path.size());
  PlotSeries start = {"start", {}, kStart, 6, 0}, end = {"end", {}, kEnd, 6, 0, true};
  if (!path.empty()) start.points = {path.front()}, end.points = {path.back()};
  panel.series = {points, {"true path", view(overview.true_cameras), kBlack, 0, 6}, cameras, end, start};
  const double reach = reach_of(overview, options);
  panel.x = view_range(panel, 0, reach, options.far_points);
  panel.y = view_range(panel, 1, reach, options.far_points);
  return panel;
}

}  // namespace

cv::Mat draw_overview(const Overview& overview, const OverviewOptions& options) {
  using Eigen::Vector3d;
  const View above = {"from above", "x, to the right", "z, forward", Vector3d::UnitX(), Vector3d::UnitZ()};
  const View side = {"from the side", "along the longest direction", "-y, up",
                     longest_direction(overview, options.far_points), -Vector3d::UnitY()};
  const int size = 800, header = overview.title.empty() ? 0 : 44;
  cv::Mat picture(size + header, 2 * size, CV_8UC3, cv::Scalar::all(255));
  draw_panel(make_panel(overview, above, options), {0, header, size, size}, &picture);
  draw_panel(make_panel(overview, side, options), {size, header, size, size}, &picture);
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
