#include "io/plot.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <utility>

#include "common/text.h"
#include "io/image_writing.h"

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
  constexpr double kRounding = 1e-9;
  const int count = 1 + static_cast<int>(std::floor((range.high - first) / step + kRounding));
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

}  // namespace mono_pose_tracker
