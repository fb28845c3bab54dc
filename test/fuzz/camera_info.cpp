// sensor_msgs/CameraInfo: what it is taken for must be a camera.
#include <cmath>

#include "fuzz_target.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "ros/camera_info.h"

using namespace mono_pose_tracker;

namespace {

constexpr const char* kModels[] = {"", "plumb_bob", "rational_polynomial", "equidistant", "fisheye"};

sensor_msgs::CameraInfo take_info(FuzzInput* input) {
  sensor_msgs::CameraInfo info;
  info.width = input->take<std::uint32_t>();
  info.height = input->take<std::uint32_t>();
  info.distortion_model = kModels[input->take<std::uint8_t>() % 5];
  info.D.resize(input->take<std::uint8_t>() % 16);
  // Floats: more of the shorter numbers make sense.
  for (double& d : info.D) d = input->take<float>();
  info.K = {
      input->take<float>(), 0, input->take<float>(), 0, input->take<float>(), input->take<float>(), 0, 0, 1};
  info.R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.P = {input->take<float>(),
            0,
            input->take<float>(),
            0,
            0,
            input->take<float>(),
            input->take<float>(),
            0,
            0,
            0,
            1,
            0};
  info.binning_x = input->take<std::uint32_t>();
  info.binning_y = input->take<std::uint32_t>();
  info.roi.x_offset = input->take<std::uint32_t>();
  info.roi.y_offset = input->take<std::uint32_t>();
  info.roi.width = input->take<std::uint32_t>();
  info.roi.height = input->take<std::uint32_t>();
  return info;
}

}  // namespace

FUZZ_TARGET(camera_info) {
  FuzzInput input(bytes, size);
  const bool rectified = input.take<std::uint8_t>() % 2 == 1;
  const ConvertedCamera converted = convert_camera_info(take_info(&input), rectified);
  if (converted.reason != Reason::kOk) {
    FUZZ_CHECK(is_one_line(converted.error.c_str()));
    return;
  }
  const CameraModel camera(converted.parameters);
  for (const double x : {0.0, 0.5, 1.0}) {
    for (const double y : {0.0, 0.5, 1.0}) {
      const Eigen::Vector3d bearing = camera.bearing({x * (camera.width() - 1), y * (camera.height() - 1)});
      FUZZ_CHECK(std::abs(bearing.norm() - 1) < 1e-9);
      Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
      if (camera.project(bearing, &pixel)) FUZZ_CHECK(pixel.allFinite());
    }
  }
}
