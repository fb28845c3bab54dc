#include "evaluation/trajectory_plot.h"

#include <opencv2/imgproc.hpp>

#include "common/text.h"
#include "common/time_stamp.h"
#include "io/plot.h"

namespace mono_pose_tracker {
namespace {

const cv::Scalar kReference(215, 110, 30), kEstimate(30, 140, 20), kError(40, 40, 215);

PlotRange range_of_axis(const std::vector<PlotSeries>& all, int axis) {
  std::vector<double> values;
  for (const PlotSeries& series : all) {
    for (const Eigen::Vector2d& point : series.points) values.push_back(point[axis]);
  }
  return with_margin(range_of(values), 0.05);
}

/// Both trajectories, seen along one of the view's axes.
PlotPanel view(const TrajectoryError& error, int x_axis, int y_axis, double y_sign) {
  const Rigid3 view_from_reference = error.reference_from_view.inverse();
  PlotSeries reference = {"reference", {}, kReference, 2, 4};
  PlotSeries estimate = {"estimate, aligned", {}, kEstimate, 2, 1};
  for (const MatchedPosition& p : error.positions) {
    const Eigen::Vector3d r = view_from_reference * p.reference, e = view_from_reference * p.estimate;
    reference.points.emplace_back(r[x_axis], y_sign * r[y_axis]);
    estimate.points.emplace_back(e[x_axis], y_sign * e[y_axis]);
  }
  PlotPanel panel;
  panel.equal_axes = true;
  panel.series = {reference, estimate};
  panel.x = range_of_axis(panel.series, 0);
  panel.y = range_of_axis(panel.series, 1);
  return panel;
}

/// A quantity of each matched frame over time.
template <typename Quantity>
PlotPanel over_time(const TrajectoryError& error, double most, const Quantity& quantity) {
  PlotSeries errors = {"", {}, kError, 2, 1};
  for (const MatchedPosition& p : error.positions) {
    const double seconds = seconds_between(error.positions.front().stamp_ns, p.stamp_ns);
    errors.points.emplace_back(seconds, quantity(p));
  }
  PlotPanel panel;
  panel.x_label = "s since the first matched frame";
  panel.series = {errors};
  panel.x = range_of_axis(panel.series, 0);
  panel.y = {0, std::max(1.05 * most, 1e-12)};
  return panel;
}

PlotPanel position_error_over_time(const TrajectoryError& error) {
  PlotPanel panel = over_time(error, error.position_max,
                              [](const MatchedPosition& p) { return (p.estimate - p.reference).norm(); });
  panel.title = formatted("position error (ATE): rmse %.4g, %.3g %% of the path", error.position_rmse,
                          error.position_rmse_percent);
  panel.y_label = "error (units of the reference)";
  return panel;
}

PlotPanel rotation_error_over_time(const TrajectoryError& error) {
  PlotPanel panel =
      over_time(error, error.rotation_max_deg, [](const MatchedPosition& p) { return p.rotation_deg; });
  panel.title = formatted("rotation error: %.3g degrees at most", error.rotation_max_deg);
  panel.y_label = "error (degrees)";
  return panel;
}

}  // namespace

cv::Mat draw_trajectory_plot(const TrajectoryError& error) {
  PlotPanel above = view(error, 0, 2, 1);
  above.title = "from above";
  above.x_label = "to the right of the first camera";
  above.y_label = "forward";
  PlotPanel side = view(error, 2, 1, -1);
  side.title = "from the side";
  side.x_label = "forward of the first camera";
  side.y_label = "up";
  const int size = 700, below = 360;
  cv::Mat picture(size + below, 2 * size, CV_8UC3, cv::Scalar::all(255));
  draw_panel(above, {0, 0, size, size}, &picture);
  draw_panel(side, {size, 0, size, size}, &picture);
  draw_panel(position_error_over_time(error), {0, size, size, below}, &picture);
  draw_panel(rotation_error_over_time(error), {size, size, size, below}, &picture);
  return picture;
}

void write_trajectory_plot(const std::string& path, const TrajectoryError& error) {
  write_picture(path, draw_trajectory_plot(error));
}

}  // namespace mono_pose_tracker
