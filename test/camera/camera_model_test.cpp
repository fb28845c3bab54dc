#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "common/statistics.h"
#include "mono_pose_tracker/camera/camera_model.h"

namespace mono_pose_tracker {
namespace {

CameraParameters parameters(const std::string& model, const std::vector<double>& distortion) {
  CameraParameters p;
  p.width = 752;
  p.height = 480;
  p.fx = 458.654;
  p.fy = 457.296;
  p.cx = 367.215;
  p.cy = 248.375;
  p.distortion_model = model;
  p.distortion = distortion;
  return p;
}

std::vector<CameraParameters> cameras() {
  return {parameters("", {}),
          parameters("plumb_bob", {}),
          parameters("plumb_bob", {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0}),  // EuRoC
          parameters("plumb_bob", {0.12, -0.1, 0.002, -0.003}),
          parameters("rational_polynomial",
                     {0.4505, -2.6627, 0.00085, -0.00034, 1.6202, 0.3278, -2.4890, 1.5438}),  // Azure Kinect
          parameters("equidistant", {0.0034823894, 0.0007150348, -0.0020532361, 0.0002029367}),  // TUM-VI
          parameters("equidistant", {-0.03, 0.01, 0.002, -0.001})};
}

Eigen::Vector2d random_pixel(Random& random, const CameraParameters& p) {
  return {random.uniform(-0.5, p.width - 0.5), random.uniform(-0.5, p.height - 0.5)};
}

TEST(CameraModel, ProjectsItsOwnBearings) {
  for (const CameraParameters& p : cameras()) {
    const CameraModel camera(p);
    Random random(1);
    for (int i = 0; i < 5000; ++i) {
      const Eigen::Vector2d pixel = random_pixel(random, p);
      const Eigen::Vector3d bearing = camera.bearing(pixel);
      EXPECT_NEAR(bearing.norm(), 1, 1e-12);
      Eigen::Vector2d back;
      ASSERT_TRUE(camera.project(random.uniform(0.1, 10) * bearing, &back)) << pixel.transpose();
      ASSERT_LT((back - pixel).norm(), 1e-9) << p.distortion_model << ' ' << pixel.transpose();
    }
  }
}

TEST(CameraModel, JacobianIsTheDerivative) {
  for (const CameraParameters& p : cameras()) {
    const CameraModel camera(p);
    Random random(2);
    for (int i = 0; i < 500; ++i) {
      const Eigen::Vector3d x = random.uniform(0.5, 4) * camera.bearing(random_pixel(random, p));
      Eigen::Vector2d pixel;
      Eigen::Matrix<double, 2, 3> jacobian, numeric;
      ASSERT_TRUE(camera.project(x, &pixel, &jacobian));
      for (int k = 0; k < 3; ++k) {
        const double h = 1e-6;
        Eigen::Vector2d plus, minus;
        ASSERT_TRUE(camera.project(x + h * Eigen::Vector3d::Unit(k), &plus));
        ASSERT_TRUE(camera.project(x - h * Eigen::Vector3d::Unit(k), &minus));
        numeric.col(k) = (plus - minus) / (2 * h);
      }
      ASSERT_LT((jacobian - numeric).norm(), 1e-5 * jacobian.norm());
    }
  }
}

TEST(CameraModel, JacobianOnTheAxisOfAFisheye) {
  const CameraModel camera(cameras()[5]);
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> jacobian;
  ASSERT_TRUE(camera.project({0, 0, 2}, &pixel, &jacobian));
  EXPECT_DOUBLE_EQ(pixel.x(), 367.215);
  EXPECT_DOUBLE_EQ(jacobian(0, 0), 458.654 / 2);
  EXPECT_DOUBLE_EQ(jacobian(1, 1), 457.296 / 2);
  EXPECT_EQ(jacobian(0, 2), 0);
}

TEST(CameraModel, AgreesWithOpenCV) {
  for (const CameraParameters& p : cameras()) {
    const CameraModel camera(p);
    const cv::Matx33d k(p.fx, 0, p.cx, 0, p.fy, p.cy, 0, 0, 1);
    Random random(3);
    std::vector<cv::Point3d> points;
    std::vector<Eigen::Vector2d> ours;
    for (int i = 0; i < 500; ++i) {
      const Eigen::Vector3d x = random.uniform(0.5, 4) * camera.bearing(random_pixel(random, p));
      points.emplace_back(x.x(), x.y(), x.z());
      ours.emplace_back();
      ASSERT_TRUE(camera.project(x, &ours.back()));
    }
    std::vector<cv::Point2d> theirs;
    if (p.distortion_model == "equidistant") {
      cv::fisheye::projectPoints(points, theirs, cv::Vec3d(), cv::Vec3d(), k, p.distortion);
    } else {
      cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), k, p.distortion, theirs);
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_NEAR(ours[i].x(), theirs[i].x, 1e-8) << p.distortion_model;
      ASSERT_NEAR(ours[i].y(), theirs[i].y, 1e-8) << p.distortion_model;
    }
  }
}

TEST(CameraModel, RefusesPointsBehindAndNonsense) {
  for (const CameraParameters& p : cameras()) {
    const CameraModel camera(p);
    Eigen::Vector2d pixel(-7, -7);
    EXPECT_FALSE(camera.project({0, 0, -1}, &pixel));
    EXPECT_FALSE(camera.project({0, 0, 0}, &pixel));
    EXPECT_FALSE(camera.project({std::nan(""), 0, 1}, &pixel));
    EXPECT_FALSE(camera.project({0, 0, std::nan("")}, &pixel));
    EXPECT_EQ(pixel, Eigen::Vector2d(-7, -7));
  }
}

// Some drivers fill in a fixed number of zeros, more than any model has coefficients.
TEST(CameraModel, WithoutAModelAnyNumberOfZerosIsNoDistortion) {
  CameraParameters p = cameras().front();
  p.distortion_model = "";
  p.distortion.assign(14, 0);
  Eigen::Vector2d pixel;
  ASSERT_TRUE(CameraModel(p).project({0.1, 0, 1}, &pixel));
  EXPECT_NEAR(pixel.x(), p.cx + 0.1 * p.fx, 1e-9);
  p.distortion[13] = 0.1;
  EXPECT_THROW(CameraModel{p}, std::invalid_argument);
}

TEST(CameraModel, ZerosBeyondTheModelsCoefficientsAreDropped) {
  const std::vector<double> polynomial = {0.01, -0.02, 0.001, 0.002, 0.003},
                            fisheye = {-0.002, 0.04, -0.04, 0.006};
  const auto filled = [](std::vector<double> d, std::size_t length) {
    d.resize(length);
    return d;
  };
  for (const std::size_t length : {5, 8, 10, 12, 14}) {
    EXPECT_EQ(CameraModel(parameters("plumb_bob", filled(polynomial, length))).parameters().distortion,
              polynomial);
    EXPECT_EQ(CameraModel(parameters("equidistant", filled(fisheye, length))).parameters().distortion,
              fisheye);
    EXPECT_EQ(
        CameraModel(parameters("rational_polynomial", filled(polynomial, length))).parameters().distortion,
        filled(polynomial, 8));
    std::vector<double> surplus = filled(polynomial, length);
    surplus.resize(15);
    surplus.back() = 1e-4;
    EXPECT_THROW(CameraModel(parameters("plumb_bob", surplus)), std::invalid_argument);
    EXPECT_THROW(CameraModel(parameters("rational_polynomial", surplus)), std::invalid_argument);
    EXPECT_THROW(CameraModel(parameters("equidistant", surplus)), std::invalid_argument);
  }
}

TEST(CameraModel, NothingButZerosIsNoDistortionWhateverItsNameAndLength) {
  for (const char* model :
       {"plumb_bob", "rational_polynomial", "none", "None", "Brown Conrady", "PLUMB_BOB"}) {
    for (const std::size_t length : {0, 1, 2, 4, 5, 8, 10, 14}) {
      const CameraModel camera(parameters(model, std::vector<double>(length, 0.0)));
      Eigen::Vector2d pixel;
      ASSERT_TRUE(camera.project({0.1, 0, 1}, &pixel));
      EXPECT_NEAR(pixel.x(), camera.parameters().cx + 0.1 * camera.parameters().fx, 1e-9) << model << length;
    }
  }
  EXPECT_THROW(CameraModel(parameters("Brown Conrady", {0, 1e-3, 0, 0, 0})), std::invalid_argument);
  // A lens all the same.
  EXPECT_EQ(CameraModel(parameters("equidistant", {0, 0, 0, 0, 0})).parameters().distortion,
            std::vector<double>(4, 0.0));
}

TEST(CameraModel, TrustsTheDistortionOnlyWhileItGrows) {
  // r (1 - 0.3 r^2) turns back at r = sqrt(1 / 0.9).
  const CameraModel camera(parameters("plumb_bob", {-0.3, 0, 0, 0, 0}));
  const double end = std::sqrt(1 / 0.9);
  Eigen::Vector2d pixel;
  EXPECT_TRUE(camera.project({end - 1e-6, 0, 1}, &pixel));
  EXPECT_FALSE(camera.project({end + 1e-6, 0, 1}, &pixel));
  // No point has this pixel: its bearing is at the end of the range, in the pixel's direction.
  const Eigen::Vector3d beyond = camera.bearing({367.215 + 2 * 458.654, 248.375});
  EXPECT_NEAR(beyond.x() / beyond.z(), end, 1e-9);
  EXPECT_NEAR(beyond.y(), 0, 1e-9);

  // theta (1 - 0.1 theta^2) turns back at sqrt(1 / 0.3): beyond 90 degrees, where a fisheye may still see.
  const CameraModel fisheye(parameters("equidistant", {-0.1, 0, 0, 0}));
  const double angle = std::sqrt(1 / 0.3);
  EXPECT_TRUE(fisheye.project({std::sin(angle - 1e-6), 0, std::cos(angle - 1e-6)}, &pixel));
  EXPECT_FALSE(fisheye.project({std::sin(angle + 1e-6), 0, std::cos(angle + 1e-6)}, &pixel));
}

TEST(CameraModel, PixelsBeyondTheTrustedRangeHaveUnitBearings) {
  for (const CameraParameters& p : cameras()) {
    const CameraModel camera(p);
    Random random(4);
    for (int i = 0; i < 1000; ++i) {
      const Eigen::Vector3d bearing = camera.bearing({random.uniform(-1e4, 1e4), random.uniform(-1e4, 1e4)});
      ASSERT_NEAR(bearing.norm(), 1, 1e-12);
    }
  }
}

TEST(CameraModel, APixelThatIsNoNumberHasNoBearing) {
  for (const CameraParameters& p : cameras()) {
    for (const double value :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      EXPECT_FALSE(CameraModel(p).bearing({value, 100}).allFinite()) << p.distortion_model;
    }
  }
}

TEST(CameraModel, InImageCountsHalfAPixelAroundTheCentres) {
  const CameraModel camera(parameters("", {}));
  EXPECT_TRUE(camera.in_image({-0.5, -0.5}));
  EXPECT_FALSE(camera.in_image({-0.6, 0}));
  EXPECT_TRUE(camera.in_image({751.4, 479.4}));
  EXPECT_FALSE(camera.in_image({751.5, 100}));
  EXPECT_FALSE(camera.in_image({4, 100}, 5));
}

void expect_refused(const CameraParameters& p, const std::string& field, const std::string& value) {
  try {
    CameraModel camera(p);
    FAIL() << field << " was accepted";
  } catch (const std::invalid_argument& error) {
    const std::string message = error.what();
    EXPECT_EQ(message.find(field + " is"), 0u) << message;
    EXPECT_NE(message.find(value), std::string::npos) << message;
    EXPECT_NE(message.find("expected"), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

TEST(CameraModel, RefusesParametersOfNoCamera) {
  const CameraParameters good = parameters("plumb_bob", {0, 0, 0, 0, 0});
  CameraParameters p = good;
  p.width = 0;
  expect_refused(p, "width", "0");
  (p = good).height = -4;
  expect_refused(p, "height", "-4");
  (p = good).fx = 0;
  expect_refused(p, "fx", "0");
  (p = good).fy = std::numeric_limits<double>::infinity();
  expect_refused(p, "fy", "inf");
  (p = good).cx = std::nan("");
  expect_refused(p, "cx", "nan");
  (p = good).distortion_model = "fov";
  p.distortion[0] = 0.1;
  expect_refused(p, "distortion_model", "'fov'");
  (p = good).distortion = {0.1, 0.2, 0.3};
  expect_refused(p, "distortion", "3");
  expect_refused(parameters("rational_polynomial", {0.1, 0, 0, 0, 0, 0.1}), "distortion", "6");
  expect_refused(parameters("equidistant", {0.1, 0, 0, 0, 0.1}), "distortion", "5");
  expect_refused(parameters("plumb_bob", {std::nan(""), 0, 0, 0, 0}), "distortion", "nan");
  expect_refused(parameters("", {0.1, 0, 0, 0, 0}), "distortion_model", "empty");
}

TEST(CameraParameters, CompareByValue) {
  const CameraParameters a = parameters("plumb_bob", {0.1, 0, 0, 0, 0});
  CameraParameters b = a;
  EXPECT_TRUE(a == b);
  b.distortion[0] = 0.2;
  EXPECT_TRUE(a != b);
  (b = a).cy += 1;
  EXPECT_TRUE(a != b);
}

TEST(CameraModel, CoefficientsBeyondAllBoundsGiveNoPixel) {
  CameraParameters parameters;
  parameters.width = 320;
  parameters.height = 240;
  parameters.fx = parameters.fy = 1e200;
  parameters.cx = 160;
  parameters.cy = 120;
  parameters.distortion_model = "plumb_bob";
  parameters.distortion = {0, 0, 1e300, 1e300, 0};
  const CameraModel camera(parameters);
  Eigen::Vector2d pixel;
  EXPECT_FALSE(camera.project({0.5, 0.5, 1}, &pixel));
}

TEST(ImageScale, IsTheSameHoweverThePhoneIsHeld) {
  EXPECT_DOUBLE_EQ(image_scale(1920, 1080), 3);
  EXPECT_DOUBLE_EQ(image_scale(1080, 1920), 3);
}

TEST(ImageScale, DescriptorsHaveTheirSizeInPxHoweverSmallTheImageIs) {
  EXPECT_DOUBLE_EQ(image_scale(640, 480), 1);
  EXPECT_DOUBLE_EQ(image_scale(320, 240), 1);
}

}  // namespace

}  // namespace mono_pose_tracker
