#include <gtest/gtest.h>

#include <cstring>

#include "common/text.h"
#include "io/colmap_binary.h"
#include "mono_pose_tracker/io/colmap.h"
#include "mono_pose_tracker/io/ply.h"
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

CameraParameters camera(const std::string& model, const std::vector<double>& distortion) {
  CameraParameters p;
  p.width = 640;
  p.height = 480;
  p.fx = 500;
  p.fy = 501;
  p.cx = 319.5;
  p.cy = 239.25;
  p.distortion_model = model;
  p.distortion = distortion;
  return p;
}

/// Lines that are no comments, split at white space.
std::vector<std::vector<std::string>> lines_of(const std::string& content) {
  std::vector<std::vector<std::string>> lines;
  std::istringstream stream(content);
  for (std::string line; std::getline(stream, line);) {
    if (!line.empty() && line[0] == '#') continue;
    std::istringstream words(line);
    lines.emplace_back();
    for (std::string word; words >> word;) lines.back().push_back(word);
  }
  return lines;
}

TEST(Colmap, CameraModelIsTheSimplestThatFits) {
  const std::pair<CameraParameters, std::string> cases[] = {
      {camera("", {}), "PINHOLE 640 480 500 501 320 239.75"},
      {camera("plumb_bob", {0, 0, 0, 0, 0}), "PINHOLE 640 480 500 501 320 239.75"},
      {camera("plumb_bob", {1, 2, 3, 4, 0}), "OPENCV 640 480 500 501 320 239.75 1 2 3 4"},
      {camera("plumb_bob", {1, 2, 3, 4}), "OPENCV 640 480 500 501 320 239.75 1 2 3 4"},
      {camera("plumb_bob", {1, 2, 3, 4, 5}), "FULL_OPENCV 640 480 500 501 320 239.75 1 2 3 4 5 0 0 0"},
      {camera("rational_polynomial", {1, 2, 3, 4, 5, 6, 7, 8}),
       "FULL_OPENCV 640 480 500 501 320 239.75 1 2 3 4 5 6 7 8"},
      {camera("equidistant", {1, 2, 3, 4}), "OPENCV_FISHEYE 640 480 500 501 320 239.75 1 2 3 4"}};
  for (const auto& [parameters, expected] : cases) {
    TemporaryFolder folder;
    write_colmap_text(folder / "new/colmap", parameters, {}, {});
    const std::string content = folder.read("new/colmap/cameras.txt");
    EXPECT_NE(content.find("\n1 " + expected + "\n"), std::string::npos) << content;
  }
}

TEST(Colmap, ImagesAndTracksBelongTogether) {
  std::vector<ColmapImage> images(2);
  images[0].name = "a.png";
  images[1].name = "b.png";
  images[1].camera_from_map = Rigid3(Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5), {1, 2, 3});
  images[1].observations = {{{10, 20.25}, 1}, {{-0.5, 0}, -1}, {{3, 4}, 0}};
  std::vector<ColmapPoint> points(2);
  points[0].x_in_map = {1, 2, 1.0 / 3};
  points[1].r = 255;
  points[1].error_px = 0.25;
  TemporaryFolder folder;
  write_colmap_text(folder.path(), camera("", {}), images, points);

  const auto image_lines = lines_of(folder.read("images.txt"));
  using Words = std::vector<std::string>;
  ASSERT_EQ(image_lines.size(), 4u);
  EXPECT_EQ(image_lines[0], (Words{"1", "1", "0", "0", "0", "0", "0", "0", "1", "a.png"}));
  EXPECT_EQ(image_lines[1], (Words{"320", "240", "-1"})) << "no line is empty: many programs stop at one";
  EXPECT_EQ(image_lines[2], (Words{"2", "0.5", "-0.5", "0.5", "0.5", "1", "2", "3", "1", "b.png"}));
  EXPECT_EQ(image_lines[3], (Words{"10.5", "20.75", "2", "0", "0.5", "-1", "3.5", "4.5", "1"}));

  const auto point_lines = lines_of(folder.read("points3D.txt"));
  ASSERT_EQ(point_lines.size(), 2u);
  EXPECT_EQ(std::stod(point_lines[0][3]), 1.0 / 3);
  EXPECT_EQ((Words{point_lines[0].begin() + 4, point_lines[0].end()}), (Words{"0", "0", "0", "0", "2", "2"}));
  EXPECT_EQ((Words{point_lines[1].begin() + 4, point_lines[1].end()}),
            (Words{"255", "0", "0", "0.25", "2", "0"}));
}

TEST(Colmap, NumbersAreAsPrintfWritesThemWith17Digits) {
  for (const double value : {1.0 / 3, 1e-7, 1e22, -0.0, 5e-324, 123456.75, -1e300, 0.1 + 0.2}) {
    std::vector<ColmapPoint> points(1);
    points[0].x_in_map = {value, 0, 0};
    TemporaryFolder folder;
    write_colmap_text(folder.path(), camera("", {}), {}, points);
    EXPECT_EQ(lines_of(folder.read("points3D.txt"))[0][1], formatted("%.17g", value));
  }
}

TEST(Colmap, RefusesAnObservationOfNoPoint) {
  TemporaryFolder folder;
  std::vector<ColmapImage> images(1);
  images[0].name = "a.png";
  images[0].observations = {{{0, 0}, 3}};
  expect_error<std::invalid_argument>(
      [&] { write_colmap_text(folder.path(), camera("", {}), images, std::vector<ColmapPoint>(3)); },
      {"a.png", "3"});
}

TEST(Colmap, SaysWhenItCannotWrite) {
  TemporaryFolder folder;
  folder.write("file", "");
  expect_error([&] { write_colmap_text(folder / "file/colmap", camera("", {}), {}, {}); }, {"file/colmap"});
}

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
