#include "io/colmap_binary.h"

#include <gtest/gtest.h>

#include <cstring>

#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

CameraParameters pinhole() {
  CameraParameters p;
  p.width = 640;
  p.height = 480;
  p.fx = 500;
  p.fy = 501;
  p.cx = 319.5;
  p.cy = 239.25;
  p.distortion_model = "plumb_bob";
  p.distortion = {0, 0, 0, 0, 0};
  return p;
}

/// Takes little-endian values off the front of a file's content.
class BinaryContent {
 public:
  explicit BinaryContent(std::string bytes) : bytes_(std::move(bytes)) {}
  ~BinaryContent() { EXPECT_EQ(at_, bytes_.size()) << "all of the file is read"; }

  template <typename T>
  T take() {
    T value{};
    EXPECT_LE(at_ + sizeof value, bytes_.size());
    if (at_ + sizeof value <= bytes_.size()) std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  std::string take_name() {
    const std::string name(bytes_.c_str() + at_);
    at_ += name.size() + 1;
    return name;
  }

 private:
  std::string bytes_;
  std::size_t at_ = 0;
};

std::vector<ColmapImage> one_image() {
  std::vector<ColmapImage> images(1);
  images[0].name = "a b.png";
  images[0].camera_from_map = Rigid3(Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5), {1, 2, 3});
  images[0].observations = {{{10, 20}, -1}, {{30.5, 40}, 0}};
  return images;
}

TEST(ColmapBinary, CameraIsAPinholeWithColmapsPixels) {
  TemporaryFolder folder;
  write_colmap_binary(folder / "new/0", pinhole(), {}, {});
  BinaryContent content(folder.read("new/0/cameras.bin"));
  EXPECT_EQ(content.take<std::uint64_t>(), 1u);
  EXPECT_EQ(content.take<std::uint32_t>(), 1u);
  EXPECT_EQ(content.take<std::int32_t>(), 1);  // PINHOLE
  EXPECT_EQ(content.take<std::uint64_t>(), 640u);
  EXPECT_EQ(content.take<std::uint64_t>(), 480u);
  for (double expected : {500.0, 501.0, 320.0, 239.75}) EXPECT_EQ(content.take<double>(), expected);
}

TEST(ColmapBinary, ImagesAndTracksBelongTogether) {
  TemporaryFolder folder;
  ColmapPoint point;
  point.x_in_map = {7, 8, 9};
  point.r = 1, point.g = 2, point.b = 3;
  point.error_px = 0.25;
  write_colmap_binary(folder.path(), pinhole(), one_image(), {point});
  BinaryContent images(folder.read("images.bin"));
  EXPECT_EQ(images.take<std::uint64_t>(), 1u);
  EXPECT_EQ(images.take<std::uint32_t>(), 1u);
  for (double expected : {0.5, -0.5, 0.5, 0.5, 1.0, 2.0, 3.0}) EXPECT_EQ(images.take<double>(), expected);
  EXPECT_EQ(images.take<std::uint32_t>(), 1u);
  EXPECT_EQ(images.take_name(), "a b.png");
  EXPECT_EQ(images.take<std::uint64_t>(), 2u);
  EXPECT_EQ(images.take<double>(), 10.5);
  EXPECT_EQ(images.take<double>(), 20.5);
  EXPECT_EQ(images.take<std::uint64_t>(), ~std::uint64_t{0});
  EXPECT_EQ(images.take<double>(), 31);
  EXPECT_EQ(images.take<double>(), 40.5);
  EXPECT_EQ(images.take<std::uint64_t>(), 1u);
  BinaryContent points(folder.read("points3D.bin"));
  EXPECT_EQ(points.take<std::uint64_t>(), 1u);
  EXPECT_EQ(points.take<std::uint64_t>(), 1u);
  for (double expected : {7.0, 8.0, 9.0}) EXPECT_EQ(points.take<double>(), expected);
  for (int expected : {1, 2, 3}) EXPECT_EQ(points.take<std::uint8_t>(), expected);
  EXPECT_EQ(points.take<double>(), 0.25);
  EXPECT_EQ(points.take<std::uint64_t>(), 1u);
  EXPECT_EQ(points.take<std::uint32_t>(), 1u);  // the image
  EXPECT_EQ(points.take<std::uint32_t>(), 1u);  // its second observation
}

TEST(ColmapBinary, RefusesWhatItCannotHold) {
  TemporaryFolder folder;
  CameraParameters distorted = pinhole();
  distorted.distortion[1] = 0.1;
  EXPECT_THROW(write_colmap_binary(folder.path(), distorted, {}, {}), std::invalid_argument);
  EXPECT_THROW(write_colmap_binary(folder.path(), pinhole(), one_image(), {}), std::invalid_argument);
  folder.write("file", "");
  EXPECT_THROW(write_colmap_binary(folder / "file/0", pinhole(), {}, {}), std::runtime_error);
}

}  // namespace
}  // namespace mono_pose_tracker
