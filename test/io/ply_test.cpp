#include "mono_pose_tracker/io/ply.h"

#include <gtest/gtest.h>

#include <cstring>

#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

std::vector<ColoredPoint> two_points() {
  ColoredPoint a, b;
  a.x_in_map = {1, -2.5f, 0.1f};
  a.r = 255;
  b.x_in_map = {1e-20f, 1e20f, 3};
  b.g = 7;
  b.b = 200;
  return {a, b};
}

const std::string kProperties =
    "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";

TEST(Ply, Ascii) {
  TemporaryFolder folder;
  write_ply(folder / "p.ply", two_points(), PlyFormat::kAscii);
  const std::string content = folder.read("p.ply");
  const std::string header = "ply\nformat ascii 1.0\n" + kProperties;
  ASSERT_EQ(content.substr(0, header.size()), header);
  std::istringstream values(content.substr(header.size()));
  float x, y, z;
  int r, g, b;
  values >> x >> y >> z >> r >> g >> b;
  EXPECT_EQ(Eigen::Vector3f(x, y, z), two_points()[0].x_in_map);
  EXPECT_EQ(r, 255);
  values >> x >> y >> z >> r >> g >> b;
  EXPECT_EQ(Eigen::Vector3f(x, y, z), two_points()[1].x_in_map);
  EXPECT_EQ(g, 7);
  EXPECT_EQ(b, 200);
  EXPECT_TRUE(values);
}

TEST(Ply, BinaryLittleEndian) {
  TemporaryFolder folder;
  write_ply(folder / "p.ply", two_points());
  const std::string content = folder.read("p.ply");
  const std::string header = "ply\nformat binary_little_endian 1.0\n" + kProperties;
  ASSERT_EQ(content.substr(0, header.size()), header);
  ASSERT_EQ(content.size(), header.size() + 2 * 15);
  const char one[] = {0, 0, '\x80', '\x3f'};  // 1.0f
  EXPECT_EQ(std::memcmp(content.data() + header.size(), one, 4), 0);
  EXPECT_EQ(static_cast<unsigned char>(content[header.size() + 12]), 255);
  EXPECT_EQ(static_cast<unsigned char>(content.back()), 200);
}

TEST(Ply, SaysWhenItCannotWrite) {
  TemporaryFolder folder;
  expect_error([&] { write_ply(folder / "no/p.ply", {}); }, {"no/p.ply", "cannot be written"});
}

}  // namespace
}  // namespace mono_pose_tracker
