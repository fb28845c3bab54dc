#include "ros/map_placement.h"

#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <utility>

namespace mono_pose_tracker {
namespace {

// From the origin. Coordinates of the whole Earth are within it (UTM's reach 1e7 m, those from its centre
// 6.4e6 m), and doubles are 1.5e-8 fine there: a hundred thousandth of what a pixel tells at arm's length.
constexpr double kFarthestPlace = 1e8;

void require_pose(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation) {
  // Quaternions that were typed in have few digits: a tenth off the length of 1 is still meant as one.
  if (!position.allFinite() || !(std::abs(orientation.norm() - 1) < 0.1)) {
    throw std::runtime_error("it is not a valid pose: expected finite numbers and a unit quaternion");
  }
  const double distance = position.stableNorm();
  if (distance <= kFarthestPlace) return;
  char text[128];
  std::snprintf(text, sizeof text,
                "it is %.3g from the origin, expected at most %.0e: poses would lose precision", distance,
                kFarthestPlace);
  throw std::runtime_error(text);
}

}  // namespace

std::string MapPlacement::follow(const std_msgs::Header& image_header, const FrameReport& report) {
  present_.reset();
  follow_moves(report);
  if (report.map_from_camera) {
    present_ = PresentPose{image_header, moved_from_map_ * *report.map_from_camera, report.scale};
  }
  if (!scale_from_odometry_) return "";
  follow_map(report);
  if (!present_ || is_rescaling_) {
    odometry_scale_.interrupt();
    return "";
  }
  // Doubtful poses are not used for measuring.
  if (report.reason == Reason::kDoubtfulPose) return "";
  const std::optional<Rigid3> odom_from_camera = frames_.odom_from_camera(image_header);
  if (!odom_from_camera) {
    odometry_scale_.interrupt();
    return "";
  }
  odometry_scale_.add(*odom_from_camera, *report.map_from_camera);
  return rescale();
}

// A move is a correction of the map, which appears in the first report that includes it.
void MapPlacement::follow_moves(const FrameReport& report) {
  const std::pair now(report.map_id, report.corrections);
  if (std::exchange(moved_at_, now) != now) moved_from_map_ = Rigid3();
}

void MapPlacement::follow_map(const FrameReport& report) {
  const MapState state(report.epoch, report.map_id, report.scale);
  if (std::exchange(state_, state) != state) {
    odometry_scale_.restart();
    is_rescaling_ = false;
  } else if (report.length_scale != 1 && !odometry_scale_.follow(report.length_scale)) {
    is_rescaling_ = false;  // this was it, or it is no longer to be had from what was measured
  }
}

std::string MapPlacement::rescale() {
  const bool was_metric = present_->scale != ScaleSource::kMapUnits;
  // While only localising, the map is not rescaled, except from its own units to metres: its own units are
  // useless to a robot.
  if (was_metric && tracker_.localizes_only()) return "";
  const std::optional<double> factor = odometry_scale_.correction(was_metric);
  if (!factor) return "";
  const OdometryScale::Estimate found = *odometry_scale_.estimate();
  is_rescaling_ = true;
  // A map in units has not been published yet: its origin stays. Later the robot must not jump in the map.
  Eigen::Vector3d stays = Eigen::Vector3d::Zero();
  if (was_metric) stays = present_->map_from_camera.translation;
  tracker_.transform_map(Sim3(*factor, Eigen::Quaterniond::Identity(), (1 - *factor) * stays),
                         ScaleSource::kOdometry);
  char text[160];
  std::snprintf(
      text, sizeof text,
      "scale/odometry: one map unit is %.4f m (+- %.1f %%, from %d path segments): the map is now in metres",
      found.metres_per_unit, 100 * found.sigma, found.segments);
  return text;
}

std::string MapPlacement::place(const geometry_msgs::PoseWithCovarianceStamped& pose) {
  const std::string& frame = pose.header.frame_id;
  if (!frame.empty() && without_leading_slashes(frame) != frames_.world()) {
    throw std::runtime_error("it is in the frame " + frame + ", expected " + frames_.world());
  }
  const auto& p = pose.pose.pose.position;
  const auto& o = pose.pose.pose.orientation;
  const Eigen::Vector3d position(p.x, p.y, p.z);
  const Eigen::Quaterniond orientation(o.w, o.x, o.y, o.z);
  require_pose(position, orientation);
  if (!present_) throw std::runtime_error("there is no present pose to replace");
  const Rigid3 wanted =
      frames_.map_from_camera(present_->header, present_->scale, {orientation.normalized(), position});
  const Rigid3 new_from_map = wanted * present_->map_from_camera.inverse();
  tracker_.transform_map(Sim3(new_from_map), std::nullopt);
  moved_from_map_ = new_from_map * moved_from_map_;
  present_->map_from_camera = wanted;
  char text[128];
  std::snprintf(text, sizeof text, "the map is moved: the present pose is at (%.3f, %.3f, %.3f) in ",
                position.x(), position.y(), position.z());
  return text + frames_.world();
}

}  // namespace mono_pose_tracker
