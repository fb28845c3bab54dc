#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "mono_pose_tracker/io/ply.h"

namespace mono_pose_tracker {

struct PlotSeries {
  std::string name;                     // for the legend; empty: not in it
  std::vector<Eigen::Vector2d> points;  // one that is not finite is not drawn, and breaks the line
  cv::Scalar color;                     // BGR
  double radius_px = 2;                 // of the dots; 0: none
  int line_px = 0;                      // thickness of the line that joins them; 0: none
  bool is_square = false;               // squares in place of dots
  // BGR, one for each point and the line that starts at it, in place of `color`; empty: `color` for all.
  std::vector<cv::Scalar> colors = {};
};

struct PlotRange {
  double low = 0, high = 1;
};

/// One diagram: x to the right, y upwards.
struct PlotPanel {
  std::string title, x_label, y_label;
  PlotRange x, y;
  bool equal_axes = false;  // one unit is as long on both axes: the ranges grow as needed
  std::vector<PlotSeries> series;
};

/// The range that holds all but the given shares of the values at either end. Empty input: 0 to 1.
PlotRange range_of(std::vector<double> values, double share_below = 0, double share_above = 0);

/// The smallest range that holds both.
PlotRange united(const PlotRange& a, const PlotRange& b);

/// The range grown by a share of its length at both ends; an empty one gets a length.
PlotRange with_margin(const PlotRange& range, double share);

/// Draws a panel with its axes, scale, title and legend into a part of a CV_8UC3 picture. What lies outside
/// the ranges is cut.
void draw_panel(const PlotPanel& panel, const cv::Rect& area, cv::Mat* picture);

/// Writes a picture in the format of the name's extension, atomically. Throws std::runtime_error naming the
/// path when it cannot.
void write_picture(const std::string& path, const cv::Mat& picture);

/// What a map looks like at a glance. Positions are in the map, whose axes are optical (x right, y down, z
/// forward).
struct Overview {
  std::string title;
  std::string unit = "map units";    // of all lengths
  std::vector<ColoredPoint> points;  // drawn in their own colours
  // By time, drawn from blue to red; start and end are marked. no_camera() breaks the line that joins them.
  std::vector<Eigen::Vector3d> cameras;
  std::vector<Eigen::Vector3d> true_cameras;  // by time, a wide black line below; may be empty
};

/// Stands for images without a pose.
inline Eigen::Vector3d no_camera() {
  return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
}

struct OverviewOptions {
  double brightest = 190;    // grey level above which a point's colour is darkened, to be visible on white
  double far_points = 0.03;  // share of the points that the view may cut at either end of an axis: the far
                             // background and badly triangulated points
  std::size_t max_cameras = 100, max_points = 5000;  // whose distances determine the range of the view
};

/// Two panels with equal axes: from above (x, z), and from the side: -y upwards, and to the right the
/// direction across it in which points and cameras spread most. The view holds every camera, and the
/// points round its way but for what is far beyond what it mostly saw.
cv::Mat draw_overview(const Overview& overview, const OverviewOptions& options = {});

/// Writes draw_overview's picture. Throws std::runtime_error naming the path when it cannot.
void write_overview(const std::string& path, const Overview& overview);

}  // namespace mono_pose_tracker
