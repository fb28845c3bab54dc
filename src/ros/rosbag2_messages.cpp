#include "rosbag2_messages.h"

#include <boost/make_shared.hpp>
#include <string>

#include "cdr_reader.h"

namespace mono_pose_tracker {

namespace {

std::string read_ros2_header(CdrReader& in, std::int64_t* stamp_ns) {
  const std::int64_t seconds = in.i32();
  *stamp_ns = seconds * 1'000'000'000 + in.u32();
  return in.text();
}

}  // namespace

sensor_msgs::ImagePtr read_ros2_image(std::string_view cdr, std::int64_t* stamp_ns) {
  CdrReader in(cdr);
  const auto image = boost::make_shared<sensor_msgs::Image>();
  image->header.frame_id = read_ros2_header(in, stamp_ns);
  image->height = in.u32();
  image->width = in.u32();
  image->encoding = in.text();
  image->is_bigendian = in.u8();
  image->step = in.u32();
  const std::string_view data = in.octets();
  image->data.assign(data.begin(), data.end());
  return image;
}

std::vector<unsigned char> read_ros2_compressed_image(std::string_view cdr, std::int64_t* stamp_ns,
                                                      std::string* format) {
  CdrReader in(cdr);
  read_ros2_header(in, stamp_ns);
  const auto stated = in.text();  // the bytes decide
  if (format) *format = stated;
  const std::string_view data = in.octets();
  return {data.begin(), data.end()};
}

sensor_msgs::CameraInfo read_ros2_camera_info(std::string_view cdr, std::int64_t* stamp_ns) {
  CdrReader in(cdr);
  sensor_msgs::CameraInfo info;
  info.header.frame_id = read_ros2_header(in, stamp_ns);
  info.height = in.u32();
  info.width = in.u32();
  info.distortion_model = in.text();
  info.D.resize(in.length(sizeof(double)));
  for (double& value : info.D) value = in.f64();
  for (double& value : info.K) value = in.f64();
  for (double& value : info.R) value = in.f64();
  for (double& value : info.P) value = in.f64();
  info.binning_x = in.u32();
  info.binning_y = in.u32();
  info.roi.x_offset = in.u32();
  info.roi.y_offset = in.u32();
  info.roi.height = in.u32();
  info.roi.width = in.u32();
  info.roi.do_rectify = in.u8();
  return info;
}

}  // namespace mono_pose_tracker
