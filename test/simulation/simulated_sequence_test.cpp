#include "simulation/simulated_sequence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "mono_pose_tracker/features/sift.h"
#include "simulation/head_scene.h"
#include "support/rendered_sequences.h"

namespace mono_pose_tracker {
namespace {

TEST(SimulatedSequence, ImagesAgreeWithPosesAndShape) {
  for (const SceneKind scene : {SceneKind::kHead, SceneKind::kRoom, SceneKind::kPlane}) {
    SequenceOptions options = small_options(scene);
    options.lights_move_with_camera = false;  // else brightness changes would pass for shifts
    const SimulatedSequence sequence(options);
    for (const auto& [a, b] : {std::pair(10, 12), std::pair(100, 106)}) {
      const Eigen::Vector2d shift = misplacement(sequence, a, b);
      EXPECT_LT(shift.norm(), 0.03) << "scene " << static_cast<int>(scene) << ", frames " << a << " and "
                                    << b;
    }
  }
}

TEST(SimulatedSequence, ImagesAgreeWithPosesUnderDistortion) {
  SequenceOptions options = small_options(SceneKind::kRoom);
  options.camera.distortion = {-0.28, 0.07, 0.0002, 0.00002, 0};
  EXPECT_LT(misplacement(SimulatedSequence(options), 10, 12).norm(), 0.03);
  options.camera.distortion_model = "equidistant";
  options.camera.distortion = {0.01, -0.005, 0.001, 0};
  EXPECT_LT(misplacement(SimulatedSequence(options), 10, 12).norm(), 0.03);
}

TEST(SimulatedSequence, HitsLieOnTheHeadAndProjectBack) {
  const SimulatedSequence sequence(small_options(SceneKind::kHead));
  int hits = 0;
  for (const int frame : {0, 40, 119}) {
    const Rigid3 camera_from_map = sequence.path()[frame].map_from_camera.inverse();
    for (int y = 0; y < 150; y += 7) {
      for (int x = 0; x < 200; x += 7) {
        Eigen::Vector3d point;
        Eigen::Vector2d pixel;
        if (!point_seen(sequence, frame, Eigen::Vector2d(x, y), &point)) continue;
        ++hits;
        EXPECT_LT(std::fabs(head_distance(point)), 1e-6);
        ASSERT_TRUE(sequence.camera().project(camera_from_map * point, &pixel));
        EXPECT_LT((pixel - Eigen::Vector2d(x, y)).norm(), 1e-6);
      }
    }
  }
  EXPECT_GT(hits, 300);
}

TEST(SimulatedSequence, MasksAreTheSilhouettes) {
  const SimulatedSequence head(small_options(SceneKind::kHead));
  for (const int frame : {0, 40, 119}) {
    const cv::Mat mask = head.render(frame).mask;
    int wrong = 0;
    for (int y = 0; y < mask.rows; ++y) {
      for (int x = 0; x < mask.cols; ++x) {
        Eigen::Vector3d point;
        const bool object = point_seen(head, frame, Eigen::Vector2d(x, y), &point);
        wrong += mask.at<std::uint8_t>(y, x) != (object ? 255 : 0);
      }
    }
    // A ray that grazes the head within the micrometres it is cast to may fall either way.
    EXPECT_LE(wrong, 2) << "frame " << frame;
  }
  for (const SceneKind scene : {SceneKind::kRoom, SceneKind::kPlane}) {
    EXPECT_EQ(cv::countNonZero(SimulatedSequence(small_options(scene)).render(60).mask), 200 * 150);
  }
}

TEST(SimulatedSequence, TheHeadTurnsAsInThePaper) {
  const SimulatedSequence sequence(small_options(SceneKind::kHead));
  ASSERT_EQ(sequence.size(), 120);
  const auto face_in_camera = [&](int frame) {  // where the face looks
    return Eigen::Vector3d(sequence.path()[frame].map_from_camera.rotation.conjugate() *
                           Eigen::Vector3d(0, 0, -1));
  };
  const double degree = M_PI / 180, sway = 1.5 * degree;
  EXPECT_NEAR(std::atan2(face_in_camera(0).x(), -face_in_camera(0).z()), 0, sway);
  EXPECT_NEAR(std::atan2(face_in_camera(40).x(), -face_in_camera(40).z()), -45 * degree, sway);
  EXPECT_NEAR(std::atan2(face_in_camera(79).x(), -face_in_camera(79).z()), 0, sway);
  EXPECT_NEAR(std::asin(face_in_camera(79).y()), 0, sway);
  EXPECT_NEAR(std::asin(face_in_camera(119).y()), 20 * degree, sway);
  for (int i = 1; i < 120; ++i) {
    const double step = rotation_angle_between(sequence.path()[i - 1].map_from_camera.rotation,
                                               sequence.path()[i].map_from_camera.rotation);
    EXPECT_LT(step, 2.5 * degree) << "frame " << i;
  }
}

TEST(SimulatedSequence, SameSeedSameBytesWhateverTheThreads) {
  for (const SceneKind scene : {SceneKind::kHead, SceneKind::kRoom}) {
    SequenceOptions options = small_options(scene);
    options.noise_grey_levels = 2;
    options.blur_px = 0.7;
    options.exposure_drift = 0.2;
    options.occluder = true;
    options.threads = 1;
    const SimulatedFrame one = SimulatedSequence(options).render(70);
    options.threads = 3;
    const SimulatedSequence again(options);
    again.render(3);  // frames do not depend on those rendered before
    const SimulatedFrame three = again.render(70);
    EXPECT_EQ(cv::norm(one.image, three.image, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(one.mask, three.mask, cv::NORM_INF), 0);
    EXPECT_EQ(one.stamp_ns, three.stamp_ns);
    options.seed = 2;
    EXPECT_GT(cv::norm(one.image, SimulatedSequence(options).render(70).image, cv::NORM_INF), 20);
  }
}

TEST(SimulatedSequence, ABonnetIsFixedToTheCamera) {
  SequenceOptions options = small_options(SceneKind::kRoom);
  const SimulatedFrame without = SimulatedSequence(options).render(5);
  options.bonnet = BonnetKind::kStill;
  const SimulatedSequence still(options);
  const SimulatedFrame one = still.render(5), other = still.render(60);
  const cv::Mat bonnet = (without.mask != 0) & (one.mask == 0);
  EXPECT_GT(cv::countNonZero(bonnet), 0.1 * bonnet.total());
  EXPECT_LT(cv::countNonZero(bonnet), 0.3 * bonnet.total());
  EXPECT_EQ(cv::norm(one.image, other.image, cv::NORM_INF, bonnet), 0);
  EXPECT_EQ(cv::norm(one.image, without.image, cv::NORM_INF, bonnet == 0), 0);
  options.bonnet = BonnetKind::kShakes;
  const SimulatedSequence shaking(options);
  EXPECT_GT(cv::norm(shaking.render(5).image, shaking.render(9).image, cv::NORM_INF, bonnet), 10);
}

TEST(SimulatedSequence, NoiseHasTheDeviationAskedFor) {
  SequenceOptions options = small_options(SceneKind::kPlane);
  const cv::Mat clean = SimulatedSequence(options).render(5).image;
  options.noise_grey_levels = 4;
  const SimulatedSequence noisy(options);
  cv::Mat grey_clean, grey_noisy, grey_next;
  cv::cvtColor(clean, grey_clean, cv::COLOR_BGR2GRAY);
  cv::cvtColor(noisy.render(5).image, grey_noisy, cv::COLOR_BGR2GRAY);
  cv::Mat difference;
  cv::subtract(grey_noisy, grey_clean, difference, cv::noArray(), CV_32F);
  cv::Scalar mean, deviation;
  // Where no colour can leave the range of 8 bits.
  cv::Mat inner;
  cv::inRange(clean, cv::Scalar(25, 25, 25), cv::Scalar(230, 230, 230), inner);
  cv::meanStdDev(difference, mean, deviation, inner);
  EXPECT_NEAR(mean[0], 0, 0.15);
  EXPECT_NEAR(deviation[0], 4, 0.2);
}

TEST(SimulatedSequence, ExposureDriftsByTheShareAskedFor) {
  SequenceOptions options = small_options(SceneKind::kRoom);
  options.frames = 7;  // the first maximum is at frame 1
  const double plain = cv::mean(SimulatedSequence(options).render(1).image)[1];
  options.exposure_drift = 0.1;
  EXPECT_NEAR(cv::mean(SimulatedSequence(options).render(1).image)[1] / plain, 1.1, 0.01);
}

TEST(SimulatedSequence, TheBackgroundStandsStill) {
  SequenceOptions options = small_options(SceneKind::kHead);
  options.background = BackgroundKind::kTextured;
  const SimulatedSequence sequence(options);
  const SimulatedFrame a = sequence.render(0), b = sequence.render(40);
  cv::Mat behind_both;
  cv::dilate(a.mask | b.mask, behind_both, cv::Mat(), {-1, -1}, 2);
  behind_both = behind_both == 0;
  EXPECT_EQ(cv::norm(a.image, b.image, cv::NORM_INF, behind_both), 0);
  cv::Scalar mean, deviation;
  cv::meanStdDev(a.image, mean, deviation, behind_both);
  EXPECT_GT(deviation[1], 15) << "texture worth the name";
  EXPECT_GT(cv::norm(a.image, b.image, cv::NORM_INF, a.mask & b.mask), 20);
}

TEST(SimulatedSequence, TheOccluderIsNoObject) {
  SequenceOptions options = small_options(SceneKind::kHead);
  const cv::Mat free = SimulatedSequence(options).render(60).mask;
  options.occluder = true;
  const SimulatedSequence sequence(options);
  const cv::Mat covered = sequence.render(60).mask;
  EXPECT_EQ(cv::countNonZero(covered & ~free), 0);
  EXPECT_LT(cv::countNonZero(covered), 0.95 * cv::countNonZero(free));
  EXPECT_EQ(cv::norm(sequence.render(0).image,
                     SimulatedSequence(small_options(SceneKind::kHead)).render(0).image, cv::NORM_INF),
            0);
}

TEST(SimulatedSequence, TakesAPathOfOnesOwn) {
  SequenceOptions options = small_options(SceneKind::kPlane);
  const Eigen::Quaterniond upright(Eigen::AngleAxisd(-M_PI / 2, Eigen::Vector3d::UnitX()));  // looks along +y
  options.path = {{5, Rigid3(upright, Eigen::Vector3d(0, -2, 0))},
                  {7, Rigid3(upright, Eigen::Vector3d(0.1, -2, 0.1))}};
  const SimulatedSequence sequence(options);
  ASSERT_EQ(sequence.size(), 2);
  EXPECT_EQ(sequence.render(1).stamp_ns, 7);
  EXPECT_EQ(sequence.render(1).map_from_camera.translation, Eigen::Vector3d(0.1, -2, 0.1));
  EXPECT_LT(misplacement(sequence, 0, 1).norm(), 0.03);
}

// Mean difference of rows [first, last), grey levels.
double difference(const cv::Mat& a, const cv::Mat& b, int first, int last) {
  return cv::norm(a.rowRange(first, last), b.rowRange(first, last), cv::NORM_L1) /
         static_cast<double>(a.rowRange(first, last).total() * a.channels());
}

TEST(SimulatedSequence, ARollingShutterReadsEachRowWhereTheCameraIsThen) {
  SequenceOptions options = small_options(SceneKind::kRoom);  // 150 rows
  const std::vector<StampedPose> path = SimulatedSequence(options).path();
  options.rolling_shutter_s = 0.03;
  options.path = {path[10], path[13], path[16]};
  for (int i = 0; i < 3; ++i) options.path[i].stamp_ns = path[10 + i].stamp_ns;  // at three times the speed
  const cv::Mat rolled = SimulatedSequence(options).render(1).image;
  // The first band's middle is row 4 of 150, the last one's row 148.
  const double interval_s = 1 / options.rate_hz;
  const auto still = [&](int from, double share) {
    const Rigid3 &a = options.path[from].map_from_camera, &b = options.path[from + 1].map_from_camera;
    Rigid3 between;
    between.rotation = a.rotation.slerp(share, b.rotation);
    between.translation = a.translation + share * (b.translation - a.translation);
    SequenceOptions global = options;
    global.rolling_shutter_s = 0;
    global.path = {{path[10].stamp_ns, between}};
    return SimulatedSequence(global).render(0).image;
  };
  const cv::Mat at_first = still(0, 1 + 0.03 * (4 / 150.0 - 0.5) / interval_s);
  const cv::Mat at_last = still(1, 0.03 * (148 / 150.0 - 0.5) / interval_s);
  EXPECT_LT(difference(rolled, at_first, 1, 7), 0.1);
  EXPECT_LT(difference(rolled, at_last, 145, 150), 0.1);
  EXPECT_GT(difference(rolled, at_last, 1, 7), 0.5);
  EXPECT_GT(difference(rolled, at_first, 145, 150), 0.5);
}

TEST(SimulatedSequence, TheHeadHasFeaturesForASiftTracker) {
  const SimulatedSequence sequence(small_options(SceneKind::kHead, 640, 480));
  for (const int frame : {0, 40, 119}) {
    const SimulatedFrame rendered = sequence.render(frame);
    cv::Mat image;
    cv::cvtColor(rendered.image, image, cv::COLOR_BGR2GRAY);
    FeatureSet features;
    make_sift_extractor(SiftOptions())->extract(image, rendered.mask, &features);
    EXPECT_GE(features.size(), 400) << "frame " << frame;
  }
}

TEST(SimulatedSequence, RefusesOptionsByName) {
  SequenceOptions options = small_options(SceneKind::kHead);
  options.noise_grey_levels = -1;
  try {
    SimulatedSequence sequence(options);
    FAIL() << "taken";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("noise_grey_levels = -1"), std::string::npos) << error.what();
  }
  options = small_options(SceneKind::kHead);
  options.camera.fx = 0;
  EXPECT_THROW(SimulatedSequence{options}, std::invalid_argument);
}

double way_length(const std::vector<StampedPose>& path, std::size_t end) {
  double length = 0;
  for (std::size_t i = 1; i < end; ++i) {
    length += (path[i].map_from_camera.translation - path[i - 1].map_from_camera.translation).norm();
  }
  return length;
}

// Where the walk is back at its beginning, looking the same way; 0 when it never is.
std::size_t back_at(const std::vector<StampedPose>& path) {
  const Rigid3& start = path.front().map_from_camera;
  for (std::size_t i = path.size() / 3; i < path.size(); ++i) {
    if ((path[i].map_from_camera.translation - start.translation).norm() < 0.5 &&
        path[i].map_from_camera.rotation.angularDistance(start.rotation) < 0.2) {
      return i;
    }
  }
  return 0;
}

TEST(SimulatedSequence, TheBlockIsWalkedRoundAndLooksTheSameAgain) {
  const SimulatedSequence block(small_options(SceneKind::kBlock));
  const std::size_t back = back_at(block.path());
  ASSERT_GT(back, 0u);
  EXPECT_NEAR(way_length(block.path(), back), 200, 10);
  EXPECT_NEAR(way_length(block.path(), block.path().size()), 215, 10);
  // The wall that the middle of the image shows is the same, some metres ahead.
  Eigen::Vector3d first, second;
  const Eigen::Vector2d middle(100, 75);
  ASSERT_TRUE(point_seen(block, 0, middle, &first));
  ASSERT_TRUE(point_seen(block, static_cast<int>(back), middle, &second));
  EXPECT_LT((first - second).norm(), 2.5);
  // The same way in a few images.
  SequenceOptions few = small_options(SceneKind::kBlock, 64, 48);
  few.frames = 12;
  const SimulatedSequence thinned(few);
  EXPECT_EQ(thinned.size(), 12);
  cv::Scalar mean, deviation;
  cv::meanStdDev(thinned.render(5).image, mean, deviation);
  EXPECT_GT(deviation[0], 10) << "houses have fronts";
}

TEST(SimulatedSequence, TheFigureOfEightComesBackToTheStreet) {
  const SimulatedSequence eight(small_options(SceneKind::kEight));
  EXPECT_GT(back_at(eight.path()), 0u);
  EXPECT_NEAR(way_length(eight.path(), eight.path().size()), 230, 30);
}

TEST(SimulatedSequence, DoorsOfTheCorridorLookTheSame) {
  const SequenceOptions options = small_options(SceneKind::kCorridor);
  const SimulatedSequence corridor(options);
  EXPECT_EQ(back_at(corridor.path()), 0u) << "its other wall is seen on the way back";
  // What the middle of two doors looks like, 3 m apart.
  const auto color_at = [&](double y, double z) {
    const Ray ray{{0, y, z}, {-1, 0, 0}};
    Hit hit;
    EXPECT_TRUE(corridor.scene().intersect(ray, 0, &hit));
    return corridor.scene().albedo(hit, ray.origin + hit.distance * ray.direction, 0.01f);
  };
  int between_differ = 0;
  for (double z = 0.2; z < 2; z += 0.2) {
    EXPECT_LT((color_at(10, z) - color_at(13, z)).norm(), 1e-3f) << z;  // doors are at 0.5 + 3 k to 1.5 + 3 k
    between_differ += (color_at(11.5, z) - color_at(14.5, z)).norm() > 1e-3f;
  }
  EXPECT_GE(between_differ, 5);
}

}  // namespace
}  // namespace mono_pose_tracker
