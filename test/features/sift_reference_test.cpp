// Our SIFT beside cv::SIFT on real images: same first octave, same settings, same budget.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <opencv2/imgproc.hpp>

#include "common/toolchain.h"
#include "geometry/essential.h"
#include "io/image_source.h"
#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/features/sift.h"
#include "mono_pose_tracker/io/camera_yaml.h"
#include "mono_pose_tracker/io/trajectory.h"

namespace mono_pose_tracker {
namespace {

constexpr int kBudget = 1000;

struct Sequence {
  CameraModel camera;
  std::vector<cv::Mat> images;  // CV_8UC1
  std::vector<Rigid3> map_from_camera;
};

cv::Mat to_gray(const cv::Mat& image) {
  cv::Mat gray = image;
  if (image.channels() == 3) cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  return gray;
}

/// At most so many images, made smaller by a whole factor where they are wider than 1300 px: tests take
/// seconds.
Sequence read_sequence(const std::string& folder, int most) {
  CameraParameters parameters = read_camera_yaml(folder + "/camera.yaml");
  const int shrink = (parameters.width + 1299) / 1300;
  const std::vector<StampedPose> poses = read_tum(folder + "/groundtruth.txt");
  const auto source = open_images(folder + "/images.txt");
  Sequence sequence;
  while (static_cast<int>(sequence.images.size()) < most) {
    const SourceImage image = source->next();
    if (image.kind != SourceImage::Kind::kImage) break;
    cv::Mat gray = to_gray(image.image);
    if (shrink > 1) cv::resize(gray, gray, gray.size() / shrink, 0, 0, cv::INTER_AREA);
    sequence.images.push_back(gray);
    sequence.map_from_camera.push_back(poses.at(sequence.map_from_camera.size()).map_from_camera);
  }
  parameters.width /= shrink;
  parameters.height /= shrink;
  parameters.fx /= shrink, parameters.fy /= shrink;
  parameters.cx = (parameters.cx + 0.5) / shrink - 0.5, parameters.cy = (parameters.cy + 0.5) / shrink - 0.5;
  sequence.camera = CameraModel(parameters);
  return sequence;
}

/// Lowe's own settings, so that both look for the same.
SiftOptions same_for_both(const std::string& implementation) {
  SiftOptions options;
  options.implementation = implementation;
  options.first_octave = -1;
  options.sigma = 1.6f;
  options.contrast_threshold = 0.04f;
  options.max_features = kBudget;
  options.min_features = 0;
  return options;
}

FeatureSet extract(const std::string& implementation, const cv::Mat& gray) {
  FeatureSet set;
  make_sift_extractor(same_for_both(implementation))->extract(gray, cv::Mat(), &set);
  return set;
}

/// Matches of successive images that pass the ratio test and lie within 1 px of the true epipolar geometry.
int inliers_under_truth(const Sequence& sequence, const std::string& implementation) {
  std::vector<FeatureSet> sets;
  for (const cv::Mat& image : sequence.images) {
    sets.push_back(extract(implementation, image));
    for (const Feature& f : sets.back().features) {
      sets.back().bearings.push_back(sequence.camera.bearing(f.pixel.cast<double>()));
    }
  }
  int inliers = 0;
  for (std::size_t i = 1; i < sets.size(); ++i) {
    const Rigid3 second_from_first = sequence.map_from_camera[i].inverse() * sequence.map_from_camera[i - 1];
    if (second_from_first.translation.norm() < 1e-6) continue;  // no epipolar geometry
    const Eigen::Matrix3d essential = essential_matrix(second_from_first);
    for (const Match& m : match_descriptors(sets[i - 1].descriptors, sets[i].descriptors, MatchOptions())) {
      const double error =
          sampson_error(essential, sets[i - 1].bearings[m.first], sets[i].bearings[m.second]);
      inliers += std::abs(error) * sequence.camera.focal() < 1.0;
    }
  }
  return inliers;
}

/// A view of the same image from elsewhere: turned, scaled and seen aslant.
cv::Matx33d tilted_view(const cv::Size& size, double degrees, double scale, double slant) {
  const double c = scale * std::cos(degrees * CV_PI / 180), s = scale * std::sin(degrees * CV_PI / 180);
  const cv::Matx33d to_middle(1, 0, -0.5 * size.width, 0, 1, -0.5 * size.height, 0, 0, 1);
  const cv::Matx33d turn(c, -s, 0, s, c, 0, slant / size.width, 0.5 * slant / size.width, 1);
  return to_middle.inv() * turn * to_middle;
}

cv::Vec2d mapped(const cv::Matx33d& h, const Eigen::Vector2f& pixel) {
  const cv::Vec3d v = h * cv::Vec3d(pixel.x(), pixel.y(), 1);
  return {v[0] / v[2], v[1] / v[2]};
}

/// Factor by which lengths grow about a pixel.
double local_scale(const cv::Matx33d& h, const Eigen::Vector2f& pixel) {
  const cv::Vec2d dx = mapped(h, pixel + Eigen::Vector2f(1, 0)) - mapped(h, pixel);
  const cv::Vec2d dy = mapped(h, pixel + Eigen::Vector2f(0, 1)) - mapped(h, pixel);
  return std::sqrt(std::abs(dx[0] * dy[1] - dx[1] * dy[0]));
}

/// Share of the features whose place is in the other image that are found there again: within 1.5 px, at a
/// scale that differs by less than a quarter.
double repeatability(const std::string& implementation, const cv::Mat& gray, const cv::Matx33d& h) {
  cv::Mat warped;
  cv::warpPerspective(gray, warped, h, gray.size(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  const FeatureSet first = extract(implementation, gray), second = extract(implementation, warped);
  const double border = 20;  // px: what is mapped nearer to it may be found only partly
  int visible = 0, repeated = 0;
  for (const Feature& f : first.features) {
    const cv::Vec2d there = mapped(h, f.pixel);
    if (there[0] < border || there[1] < border || there[0] > gray.cols - border ||
        there[1] > gray.rows - border) {
      continue;
    }
    ++visible;
    const double scale = f.scale * local_scale(h, f.pixel);
    repeated += std::any_of(second.features.begin(), second.features.end(), [&](const Feature& g) {
      return std::hypot(g.pixel.x() - there[0], g.pixel.y() - there[1]) < 1.5 &&
             std::abs(std::log(g.scale / scale)) < std::log(1.25);
    });
  }
  return visible > 0 ? static_cast<double>(repeated) / visible : 0;
}

class SiftAgainstOpencvTest : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
#ifndef MONO_POSE_TRACKER_WITH_OPENCV_SIFT
    GTEST_SKIP() << "this OpenCV has no SIFT";
#endif
    const char* data = std::getenv("MONO_POSE_TRACKER_DATA");
    if (!data || !*data) GTEST_SKIP() << "MONO_POSE_TRACKER_DATA names no folder of real sequences";
    folder_ = std::string(data) + "/" + GetParam();
    if (!std::filesystem::exists(folder_)) GTEST_SKIP() << folder_ << " is not there";
  }
  std::string folder_;
};

TEST_P(SiftAgainstOpencvTest, AsManyMatchesFitTheTrueGeometry) {
  const Sequence sequence = read_sequence(folder_, 8);
  const int own = inliers_under_truth(sequence, "own"), opencv = inliers_under_truth(sequence, "opencv");
  EXPECT_GT(opencv, 500);
  EXPECT_GE(own, opencv);
}

TEST_P(SiftAgainstOpencvTest, KeyPointsAreFoundAgainAsOften) {
  const cv::Mat gray = read_sequence(folder_, 1).images.at(0);
  double own = 0, opencv = 0;
  for (const cv::Matx33d& h :
       {tilted_view(gray.size(), 20, 1, 0), tilted_view(gray.size(), 0, 0.7, 0),
        tilted_view(gray.size(), -35, 0.85, 0.3), tilted_view(gray.size(), 5, 1.2, -0.3)}) {
    own += repeatability("own", gray, h) / 4;
    opencv += repeatability("opencv", gray, h) / 4;
  }
  EXPECT_GT(opencv, 0.3);
  EXPECT_GE(own, opencv);
}

INSTANTIATE_TEST_SUITE_P(RealImages, SiftAgainstOpencvTest,
                         testing::Values("templeRing_upright", "fountain", "redkitchen_400", "kitti07_100"));

}  // namespace
}  // namespace mono_pose_tracker
