#include "mono_pose_tracker/io/colmap.h"

#include <gtest/gtest.h>

#include "common/text.h"
#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

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

}  // namespace
}  // namespace mono_pose_tracker
