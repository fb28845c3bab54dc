#include "mono_pose_tracker/io/camera_yaml.h"

#include <gtest/gtest.h>

#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

const char* const kCalibration = R"(image_width: 752
image_height: 480
camera_name: cam0
camera_matrix:
  rows: 3
  cols: 3
  data: [458.654, 0, 367.215, 0, 457.296, 248.375, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0]
)";

std::string replaced(const std::string& from, const std::string& to) {
  std::string content = kCalibration;
  return content.replace(content.find(from), from.size(), to);
}

TEST(CameraYaml, ReadsWhatCameraCalibrationWrites) {
  TemporaryFolder folder;
  const CameraParameters p = read_camera_yaml(folder.write("camera.yaml", kCalibration));
  EXPECT_EQ(p.width, 752);
  EXPECT_EQ(p.height, 480);
  EXPECT_EQ(p.fx, 458.654);
  EXPECT_EQ(p.fy, 457.296);
  EXPECT_EQ(p.cx, 367.215);
  EXPECT_EQ(p.cy, 248.375);
  EXPECT_EQ(p.distortion_model, "plumb_bob");
  EXPECT_EQ(p.distortion, (std::vector<double>{-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0}));
}

TEST(CameraYaml, RectifiedImagesHaveTheProjectionMatrix) {
  TemporaryFolder folder;
  const std::string projection =
      std::string(kCalibration) +
      "projection_matrix:\n  rows: 3\n  cols: 4\n  data: [400, 0, 370, -40, 0, 410, 250, "
      "0, 0, 0, 1, 0]\n";
  const std::string path = folder.write("camera.yaml", projection);
  const CalibrationFile rectified = read_calibration_yaml(path, true);
  EXPECT_EQ(rectified.camera.fx, 400);
  EXPECT_EQ(rectified.camera.fy, 410);
  EXPECT_EQ(rectified.camera.cx, 370);
  EXPECT_EQ(rectified.camera.cy, 250);
  EXPECT_TRUE(rectified.camera.distortion.empty());
  EXPECT_TRUE(rectified.has_distortion) << "that of the raw images";
  EXPECT_EQ(read_calibration_yaml(path, false).camera.fx, 458.654);
  expect_error([&] { read_calibration_yaml(folder.write("raw.yaml", kCalibration), true); },
               {"raw.yaml", "projection_matrix"});
}

// As the fisheye calibration of ROS leaves it by default.
TEST(CameraYaml, ASmallSkewIsIgnoredAndNoted) {
  TemporaryFolder folder;
  const auto with_skew = [&](const std::string& skew) {
    return folder.write("camera.yaml", replaced("[458.654, 0,", "[458.654, " + skew + ","));
  };
  EXPECT_NE(read_calibration_yaml(with_skew("-0.0504"), false).note.find("-0.0504"), std::string::npos);
  EXPECT_EQ(read_calibration_yaml(with_skew("0"), false).note, "");
  expect_error([&] { read_camera_yaml(with_skew("4.26")); },
               {"camera.yaml", "camera_matrix", "4.26 px", "--fisheye-fix-skew"});
}

TEST(CameraYaml, WritesWhatItReads) {
  TemporaryFolder folder;
  CameraParameters p;
  p.width = 640;
  p.height = 480;
  p.fx = 1.0 / 3 + 500;
  p.fy = 500.1;
  p.cx = 319.5;
  p.cy = 239.5;
  for (const auto& [model, distortion] :
       {std::pair<std::string, std::vector<double>>("plumb_bob", {0.1, -0.2, 1e-17, 0.3, 0.4}),
        {"rational_polynomial", {1, 2, 3, 4, 5, 6, 7, 0.1}},
        {"equidistant", {0.1, 0.2, 0.3, 0.4}}}) {
    p.distortion_model = model;
    p.distortion = distortion;
    write_camera_yaml(folder / "camera.yaml", "cam", p);
    EXPECT_TRUE(read_camera_yaml(folder / "camera.yaml") == p) << folder.read("camera.yaml");
  }
}

TEST(CameraYaml, ErrorsNameFileKeyAndValue) {
  TemporaryFolder folder;
  const auto expect = [&](const std::string& content, std::initializer_list<std::string> parts) {
    const std::string path = folder.write("bad.yaml", content);
    expect_error([&] { read_camera_yaml(path); }, {path, "expected"});
    expect_error([&] { read_camera_yaml(path); }, parts);
  };
  expect_error([&] { read_camera_yaml(folder / "none.yaml"); },
               {"none.yaml", "cannot be read (No such file"});
  expect_error([&] { read_camera_yaml(folder.path()); }, {folder.path(), "expected"});
  expect_error(
      [&] {
        read_camera_yaml(folder.write("ost.txt", "# oST version 5.0 parameters\n\n[image]\n\nwidth\n640\n"));
      },
      {"ost.txt", "ost.yaml"});
  expect("", {"holds no keys"});
  expect("a: [1", {"line", "not valid YAML"});
  expect(replaced("image_width: 752\n", ""), {"image_width"});
  expect(replaced("image_width: 752", "image_width: wide"), {"image_width", "'wide'"});
  expect(replaced("image_height: 480", "image_height: 0"), {"image_height", "0"});
  expect(replaced("458.654", "0"), {"camera_matrix: fx", "is 0"});
  expect(replaced("457.296", "-1"), {"camera_matrix: fy", "-1"});
  expect(replaced("458.654, 0,", "458.654,"), {"camera_matrix", "8"});
  expect(replaced("458.654, 0,", "458.654, 5,"), {"camera_matrix", "skew"});
  expect(replaced("458.654", "abc"), {"camera_matrix", "'abc'"});
  expect(replaced("plumb_bob", "fov"), {"distortion_model", "'fov'", "equidistant"});
  expect(replaced("1.76187114e-05, 0]", "1.76187114e-05, 0, 0.1]"), {"distortion_coefficients", "length 6"});
  expect(replaced("  data: [-0.28", "  values: [-0.28"), {"distortion_coefficients", "data"});
}

TEST(CameraYaml, SaysWhenItCannotWrite) {
  TemporaryFolder folder;
  expect_error([&] { write_camera_yaml(folder / "no/such/camera.yaml", "c", {}); }, {"no/such/camera.yaml"});
}

}  // namespace
}  // namespace mono_pose_tracker
