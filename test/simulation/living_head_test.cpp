// Heads as they are: shoulders, a face that moves, shine, and what is behind them.
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "simulation/head_scene.h"
#include "simulation/simulated_sequence.h"
#include "support/rendered_sequences.h"

namespace mono_pose_tracker {
namespace {

SequenceOptions portrait(ShouldersKind shoulders = ShouldersKind::kStill, int width = 320) {
  SequenceOptions options = small_options(SceneKind::kHead, width, 3 * width / 4);
  options.shoulders = shoulders;
  options.background = BackgroundKind::kWall;
  return options;
}

/// 255 where any colour differs by more than `levels`.
cv::Mat differing(const cv::Mat& a, const cv::Mat& b, int levels) {
  cv::Mat difference, channels[3];
  cv::absdiff(a, b, difference);
  cv::split(difference, channels);
  return (channels[0] | channels[1] | channels[2]) > levels;
}

/// Where in the head's frame two sequences of the same poses look different at a frame; NaN off the head.
std::vector<Eigen::Vector3d> differing_places(const SequenceOptions& one, const SequenceOptions& other,
                                              int frame) {
  const SimulatedSequence a(one), b(other);
  std::vector<cv::Point> pixels;
  cv::findNonZero(differing(a.render(frame).image, b.render(frame).image, 2), pixels);
  std::vector<Eigen::Vector3d> places;
  for (const cv::Point& pixel : pixels) {
    Eigen::Vector3d place = Eigen::Vector3d::Constant(NAN);
    point_seen(a, frame, Eigen::Vector2d(pixel.x, pixel.y), &place);
    places.push_back(place);
  }
  return places;
}

int pixels_between(const std::vector<Eigen::Vector3d>& places, double top, double bottom) {
  int count = 0;
  for (const Eigen::Vector3d& x : places) count += x.y() > top && x.y() < bottom && x.z() < -0.03;
  return count;
}

TEST(LivingHead, ImagesAgreeWithPosesAmidWhatMovesOtherwise) {
  SequenceOptions swaying = portrait(ShouldersKind::kSway), held = small_options(SceneKind::kTurntable);
  swaying.background = held.background = BackgroundKind::kRoom;
  swaying.hand_held = held.hand_held = true;
  for (SequenceOptions options : {portrait(), swaying, held}) {
    options.lights_move_with_camera = false;  // else brightness changes would pass for shifts
    const SimulatedSequence sequence(options);
    EXPECT_LT(misplacement(sequence, 10, 12).norm(), 0.03);
    EXPECT_LT(misplacement(sequence, 100, 102).norm(), 0.03);
  }
}

TEST(LivingHead, TheMaskIsTheHeadWithoutNeckAndShoulders) {
  const SimulatedSequence sequence(portrait());
  for (const int frame : {0, 40, 119}) {
    const cv::Mat mask = sequence.render(frame).mask;
    int wrong = 0, shoulders = 0;
    for (int y = 0; y < mask.rows; y += 2) {
      for (int x = 0; x < mask.cols; x += 2) {
        const Rigid3& map_from_camera = sequence.path()[frame].map_from_camera;
        const Ray ray{map_from_camera.translation,
                      map_from_camera.rotation * sequence.camera().bearing(Eigen::Vector2d(x, y))};
        Hit hit;
        const bool seen = sequence.scene_at(frame)->intersect(ray, 0, &hit);
        const Eigen::Vector3d point = ray.origin + hit.distance * ray.direction;
        const bool head = seen && std::fabs(head_distance(point, false)) < 1e-6;
        wrong += mask.at<std::uint8_t>(y, x) != (head ? 255 : 0);
        shoulders += seen && !head;
      }
    }
    EXPECT_LE(wrong, 2) << "frame " << frame << ": rays that graze";
    EXPECT_GT(shoulders, 500) << "frame " << frame;
  }
}

TEST(LivingHead, ShouldersStayInTheirPixelsOrSway) {
  const cv::Rect below(0, 220, 320, 20);  // the shirt, from shoulder to shoulder
  const SimulatedSequence still(portrait());
  EXPECT_LE(cv::norm(still.render(0).image(below), still.render(40).image(below), cv::NORM_INF), 1);
  EXPECT_EQ(cv::countNonZero(still.render(40).mask(below)), 0);
  const SimulatedSequence swaying(portrait(ShouldersKind::kSway));
  EXPECT_GT(cv::norm(swaying.render(0).image(below), swaying.render(40).image(below), cv::NORM_INF), 40);
  // The head does not mind what the shoulders do, but for what the neck hides of it.
  const cv::Mat mask = still.render(40).mask;
  EXPECT_LT(cv::countNonZero(swaying.render(40).mask ^ mask), 0.02 * cv::countNonZero(mask));
}

TEST(LivingHead, WhatMovesByItselfStaysInItsRegion) {
  int mouth = 0, eyes = 0, hair = 0, elsewhere = 0;
  const SequenceOptions at_rest = portrait(ShouldersKind::kStill, 240);
  for (int frame = 0; frame < 30; frame += 5) {
    SequenceOptions speaking = at_rest, blinking = at_rest, loose = at_rest;
    speaking.face.speaks = true;
    blinking.face.blinks = true;
    loose.face.loose_hair = true;
    const auto spoken = differing_places(at_rest, speaking, frame);
    const auto blinked = differing_places(at_rest, blinking, frame);
    mouth += pixels_between(spoken, 0.05, 0.14);
    eyes += pixels_between(blinked, -0.01, 0.02);
    elsewhere += static_cast<int>(spoken.size() + blinked.size()) - pixels_between(spoken, 0.05, 0.14) -
                 pixels_between(blinked, -0.01, 0.02);
    for (const Eigen::Vector3d& x : differing_places(at_rest, loose, frame)) hair += x.y() < 0.06;
  }
  EXPECT_GT(mouth, 200);
  EXPECT_GT(eyes, 40);
  EXPECT_GT(hair, 2000);
  EXPECT_LE(elsewhere, 12) << "pixels of a rim, of which a part is the region's";
}

TEST(LivingHead, HairSwaysOnAHeadThatRests) {
  SequenceOptions options = portrait(ShouldersKind::kNone, 640);
  const Rigid3 pose = SimulatedSequence(options).path()[0].map_from_camera;
  options.path = {{1000000000, pose}, {1500000000, pose}};
  const SimulatedSequence tight(options);
  EXPECT_EQ(cv::norm(tight.render(0).image, tight.render(1).image, cv::NORM_INF), 0);
  options.face.loose_hair = true;
  const SimulatedSequence loose(options);
  EXPECT_GT(cv::countNonZero(differing(loose.render(0).image, loose.render(1).image, 5)), 100);
}

/// Middle of what a shine adds, px.
Eigen::Vector2d shine_centre(const SequenceOptions& dull, int frame) {
  SequenceOptions polished = dull;
  polished.shine = 1;
  const cv::Moments moments = cv::moments(differing(SimulatedSequence(polished).render(frame).image,
                                                    SimulatedSequence(dull).render(frame).image, 60),
                                          true);
  EXPECT_GT(moments.m00, 20);
  return {moments.m10 / moments.m00, moments.m01 / moments.m00};
}

TEST(LivingHead, ShineStaysInPlaceWhileTheHeadTurns) {
  const SequenceOptions options = small_options(SceneKind::kHead);
  const SimulatedSequence sequence(options);
  Eigen::Vector2d before, after;
  const Eigen::Vector3d nose(0, 0.04, -0.115);
  ASSERT_TRUE(sequence.camera().project(sequence.path()[0].map_from_camera.inverse() * nose, &before));
  ASSERT_TRUE(sequence.camera().project(sequence.path()[20].map_from_camera.inverse() * nose, &after));
  ASSERT_GT((after - before).norm(), 15);
  EXPECT_LT((shine_centre(options, 20) - shine_centre(options, 0)).norm(), 0.4 * (after - before).norm());
}

TEST(LivingHead, TheRoomMovesOnlyBehindACameraInTheHand) {
  SequenceOptions options = small_options(SceneKind::kTurntable);
  options.background = BackgroundKind::kRoom;
  for (const bool hand_held : {false, true}) {
    options.hand_held = hand_held;
    const SimulatedSequence sequence(options);
    const SimulatedFrame a = sequence.render(0), b = sequence.render(30);
    // What is behind both; the plinth below stands still in its own colour.
    cv::Mat behind;
    cv::dilate(a.mask | b.mask, behind, cv::Mat(), {-1, -1}, 3);
    behind = behind(cv::Rect(0, 0, 200, 60)) == 0;
    const cv::Rect above(0, 0, 200, 60);
    const double changed = cv::countNonZero(differing(a.image(above), b.image(above), 20) & behind);
    if (hand_held)
      EXPECT_GT(changed, 0.3 * cv::countNonZero(behind));
    else
      EXPECT_EQ(changed, 0);
  }
}

TEST(LivingHead, TheWallIsBrightAndNearlyPlain) {
  const SimulatedFrame frame = SimulatedSequence(portrait()).render(0);
  const cv::Mat corner = frame.image(cv::Rect(0, 0, 60, 60));
  cv::Scalar mean, deviation;
  cv::meanStdDev(corner, mean, deviation);
  EXPECT_GT(mean[1], 180);
  EXPECT_LT(mean[1] + 3 * deviation[1], 250) << "not overexposed";
  EXPECT_LT(deviation[1], 6);
  EXPECT_GT(deviation[1], 0.5);
}

TEST(LivingHead, SameSeedSameBytes) {
  SequenceOptions options = portrait(ShouldersKind::kSway);
  options.background = BackgroundKind::kRoom;
  options.hand_held = options.face.speaks = options.face.blinks = options.face.loose_hair = true;
  options.shine = 0.3;
  options.threads = 1;
  const SimulatedFrame one = SimulatedSequence(options).render(17);
  options.threads = 3;
  const SimulatedSequence again(options);
  again.render(3);
  EXPECT_EQ(cv::norm(one.image, again.render(17).image, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(one.mask, again.render(17).mask, cv::NORM_INF), 0);
  options.seed = 2;
  EXPECT_GT(cv::norm(one.image, SimulatedSequence(options).render(17).image, cv::NORM_INF), 20);
}

void expect_refused(const SequenceOptions& options, const std::string& name) {
  try {
    options.validate();
    ADD_FAILURE() << name << ": taken";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
  }
}

TEST(LivingHead, RefusesWhatASceneHasNot) {
  SequenceOptions room = small_options(SceneKind::kRoom);
  room.face.speaks = true;
  expect_refused(room, "speaks");
  room = small_options(SceneKind::kRoom);
  room.background = BackgroundKind::kWall;
  expect_refused(room, "background");
  SequenceOptions held = portrait();
  held.hand_held = true;
  expect_refused(held, "hand_held");
  SequenceOptions shiny = portrait();
  shiny.shine = 1.5;
  expect_refused(shiny, "shine = 1.5");
}

}  // namespace
}  // namespace mono_pose_tracker
