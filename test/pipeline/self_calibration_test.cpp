#include "pipeline/self_calibration.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "mono_pose_tracker/tracking/tracker.h"
#include "support/simulated_room.h"
#include "support/synthetic_map.h"

namespace mono_pose_tracker {
namespace {

// The complete procedure of track_sequence on images: tracked with a wrong focal length, refined, tracked
// again.
class SelfCalibrationTest : public testing::Test {
 protected:
  static const SimulatedRoom& room() {
    static const SimulatedRoom room = simulated_room(40, 2);
    return room;
  }

  const Map* track(const CameraParameters& camera) {
    tracker_ = std::make_unique<Tracker>(TrackerOptions(), CameraModel(camera), Tracker::Mapping::kInline);
    for (const SimulatedFrame& frame : room().frames) tracker_->process(frame.stamp_ns, frame.image);
    last_ = camera;
    return tracker_->finish() ? &tracker_->map() : nullptr;
  }

  static CameraParameters off_by(double factor) {
    CameraParameters camera = room().camera.parameters();
    camera.fx *= factor;
    camera.fy *= factor;
    return camera;
  }

  std::unique_ptr<Tracker> tracker_;
  CameraParameters last_;
};

TEST_F(SelfCalibrationTest, AFocalLengthThatIsOffIsFound) {
  const SelfCalibration found =
      calibrate_by_tracking(off_by(1.3), CalibrationSource::kGuessed, {},
                            [&](const CameraParameters& camera, int) { return track(camera); });
  EXPECT_EQ(found.source, CalibrationSource::kRefined);
  EXPECT_NEAR(found.camera.fx / room().camera.parameters().fx, 1, 0.02) << "images of 320x240";
  EXPECT_EQ(found.camera, last_) << "the results are of that camera";
}

TEST_F(SelfCalibrationTest, ARightCalibrationIsNotDoubted) {
  EXPECT_EQ(doubt_of_calibration({}, room().camera.parameters(), *track(room().camera.parameters())), "");
}

// The room's ten keyframes would not show a wrong focal length in parts.
TEST_F(SelfCalibrationTest, ADistortionOfRectifiedImagesIsNamed) {
  CameraParameters raw = room().camera.parameters();
  raw.distortion = {-0.3, 0.1, 0, 0, 0};
  const std::string doubt = doubt_of_calibration({}, raw, *track(raw));
  EXPECT_NE(doubt.find("look rectified already"), std::string::npos) << doubt;
}

// Weighted means of parts, all of them and without each.
struct PartMeans {
  double whole = 0, sigma = 0;
  std::vector<double> without_part;
};

PartMeans means_of(const std::vector<double>& changes, const std::vector<double>& sigmas) {
  double sum = 0, information = 0;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    sum += changes[i] / (sigmas[i] * sigmas[i]);
    information += 1 / (sigmas[i] * sigmas[i]);
  }
  PartMeans means{sum / information, std::sqrt(1 / information), {}};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const double weight = 1 / (sigmas[i] * sigmas[i]);
    means.without_part.push_back((sum - weight * changes[i]) / (information - weight));
  }
  return means;
}

// Of calibrations with this change. The errors of the parts are `missed` times their standard deviations.
double share_of_alarms(int parts, double missed, double change, double tolerated) {
  constexpr int kRecordings = 4000;
  CalibrationDoubtOptions limits;
  limits.significance = 0.01;
  Random random(7);
  int alarms = 0;
  for (int i = 0; i < kRecordings; ++i) {
    std::vector<double> changes, sigmas;
    for (int k = 0; k < parts; ++k) {
      sigmas.push_back(random.uniform(0.001, 0.002));
      changes.push_back(change + missed * sigmas.back() * random.normal());
    }
    const PartMeans means = means_of(changes, sigmas);
    alarms += exceeds(means.whole, means.without_part, means.sigma, tolerated, limits);
  }
  return static_cast<double>(alarms) / kRecordings;
}

TEST(SelfCalibration, ItsFalseAlarmsAreTheStatedOnes) {
  for (const int parts : {3, 4, 8, 16}) {
    EXPECT_NEAR(share_of_alarms(parts, 100, 0, 0), 0.01, 0.006) << parts;
    EXPECT_LT(share_of_alarms(parts, 1, 0, 0), 0.01) << parts;
    EXPECT_LT(share_of_alarms(parts, 3, -0.02, 0.02), 0.01) << parts;
    EXPECT_GT(share_of_alarms(parts, 1, 0.05, 0.02), 0.99) << "an error of the calibration shows";
  }
}

TEST(SelfCalibration, PartsThatDisagreeOrKnowLittleShowNoChange) {
  EXPECT_TRUE(exceeds(0.1, {0.101, 0.1, 0.1, 0.099}, 0.004, 0.02, {}));
  EXPECT_TRUE(exceeds(-0.1, {-0.101, -0.1, -0.1, -0.099}, 0.004, 0.02, {}));
  EXPECT_FALSE(exceeds(0.1, {0.02, 0.12, 0.12, 0.11}, 0.004, 0.02, {})) << "one part changes it";
  EXPECT_FALSE(exceeds(0.1, {0.101, 0.1, 0.1, 0.099}, 0.022, 0.02, {})) << "the parts know little";
  EXPECT_FALSE(exceeds(0.1, {0.101, 0.1, 0.1, 0.099}, std::numeric_limits<double>::infinity(), 0.02, {}));
  EXPECT_FALSE(exceeds(0.5, {0.5, 0.5}, 0.0001, 0.02, {})) << "two parts hardly tell their scatter";
}

CameraParameters with_distortion(const std::vector<double>& distortion) {
  CameraParameters camera = with_focal(1);
  camera.distortion_model = "plumb_bob";
  camera.distortion = distortion;
  return camera;
}

// Parts of twelve poses would not determine a distortion.
std::vector<Rigid3> three_rows() {
  std::vector<Rigid3> poses;
  for (const double height : {-0.4, 0.0, 0.4}) {
    for (const Rigid3& pose : round_about()) {
      poses.push_back(pose);
      poses.back().translation.y() += height;
    }
  }
  return poses;
}

TEST(SelfCalibration, ADoubtIsOfAllPartsOfTheRecording) {
  const CameraParameters camera = with_focal(1);
  const CameraModel given(camera), shorter(with_focal(0.7));
  std::vector<CameraModel> truth(36, shorter);
  EXPECT_NE(doubt_of_calibration({}, camera, map_of(three_rows(), truth, given)), "");
  std::fill(truth.begin(), truth.begin() + 18, given);
  const Map half_wrong = map_of(three_rows(), truth, given);
  EXPECT_GT(std::abs(refine_camera({}, camera, half_wrong).focal_asked), 0.1)
      << "or there is no doubt to lift";
  EXPECT_EQ(doubt_of_calibration({}, camera, half_wrong), "");
}

TEST(SelfCalibration, AFocalLengthThatIsOffByAFewPercentIsDoubted) {
  const CameraModel truth = synthetic_camera();
  EXPECT_EQ(doubt_of_calibration({}, with_focal(1), map_of(three_rows(), truth, truth)), "");
  for (const double factor : {0.93, 1.07}) {
    const CameraParameters given = with_focal(factor);
    EXPECT_NE(doubt_of_calibration({}, given, map_of(three_rows(), truth, CameraModel(given))), "") << factor;
  }
}

// Rectified images with the calibration of the raw ones, and vice versa.
TEST(SelfCalibration, ADistortionThatTheImagesDoNotHaveIsTheSuspect) {
  const CameraParameters raw = with_distortion({-0.3, 0.1, 0, 0, 0}),
                         rectified = with_distortion({0, 0, 0, 0, 0});
  for (const bool are_rectified : {true, false}) {
    const CameraParameters& truth = are_rectified ? rectified : raw;
    const CameraParameters& given = are_rectified ? raw : rectified;
    const std::string doubt =
        doubt_of_calibration({}, given, map_of(three_rows(), CameraModel(truth), CameraModel(given)));
    EXPECT_NE(doubt.find("because of its distortion"), std::string::npos) << doubt;
    EXPECT_EQ(doubt.find("rectified already") != std::string::npos, are_rectified) << doubt;
  }
  EXPECT_EQ(doubt_of_calibration({}, raw, map_of(three_rows(), CameraModel(raw), CameraModel(raw))), "");
}

// The fit with and without distortion tells what so few keyframes do not determine in parts.
TEST(SelfCalibration, RectifiedImagesAreNamedAfterFewKeyframes) {
  const CameraParameters raw = with_distortion({-0.3, 0.1, 0, 0, 0}), rectified = with_distortion({});
  const auto doubt = [&](const CameraParameters& truth) {
    return doubt_of_calibration({}, raw, map_of(round_about(), CameraModel(truth), CameraModel(raw)));
  };
  EXPECT_NE(doubt(rectified).find("look rectified already"), std::string::npos) << doubt(rectified);
  CameraParameters smaller = rectified;  // the focal length of P, often smaller than that of K
  smaller.fx *= 0.9, smaller.fy *= 0.9;
  EXPECT_NE(doubt(smaller).find("look rectified already"), std::string::npos) << doubt(smaller);
  EXPECT_EQ(doubt(raw), "");
}

TEST(SelfCalibration, WithoutAnyMapTheGivenValueStays) {
  CameraParameters camera = default_camera(SceneKind::kRoom, 320, 240);
  int runs = 0;
  const SelfCalibration found = calibrate_by_tracking(camera, CalibrationSource::kGuessed, {},
                                                      [&](const CameraParameters& tried, int max_keyframes) {
                                                        ++runs;
                                                        if (max_keyframes == 0) {
                                                          EXPECT_EQ(tried, camera);
                                                        }
                                                        return static_cast<const Map*>(nullptr);
                                                      });
  EXPECT_EQ(found.source, CalibrationSource::kGuessed);
  EXPECT_EQ(found.camera, camera);
  EXPECT_EQ(found.runs, runs);
  EXPECT_EQ(runs, 6) << "four other focal lengths, and the given one for the report";
}

constexpr int kFewPoints = 30;

// Few points determine the focal length to half a per cent, which is not enough for a refinement.
TEST(SelfCalibration, AGuessThatTheImagesContradictIsGuessedAnewAGivenFocalLengthStays) {
  const CameraModel truth = synthetic_camera();
  CameraParameters last;
  Map map;
  const auto track = [&](const CameraParameters& camera, int) {
    last = camera;
    map = map_of(round_about(), truth, CameraModel(camera), kFewPoints);
    return &map;
  };
  const CameraParameters start = with_focal(0.7);
  const SelfCalibration guessed = calibrate_by_tracking(start, CalibrationSource::kGuessed, {}, track);
  ASSERT_FALSE(guessed.last.focal_observable);
  EXPECT_NEAR(guessed.camera.fx / truth.parameters().fx, 1, 0.03);
  EXPECT_EQ(guessed.camera, last) << "the results are of that camera";
  EXPECT_EQ(guessed.source, CalibrationSource::kGuessed) << "nothing has confirmed it";
  ASSERT_EQ(guessed.warnings.size(), 1u);
  EXPECT_NE(guessed.warnings[0].find("not observable"), std::string::npos) << guessed.warnings[0];
  EXPECT_NE(guessed.warnings[0].find("contradict"), std::string::npos) << guessed.warnings[0];

  const SelfCalibration given = calibrate_by_tracking(start, CalibrationSource::kGiven, {}, track);
  EXPECT_EQ(given.camera, start);
  EXPECT_EQ(last, start);
}

// Observable and not converged up to one run; unobservable from then on.
TEST(SelfCalibration, TheLastRunIsWithTheCameraThatIsReturned) {
  for (const int silent_from : {5, 6, 7, 8, 9}) {
    CameraParameters last;
    int runs = 0;
    Map map;
    const CameraModel truth = synthetic_camera();
    const SelfCalibration found = calibrate_by_tracking(
        with_focal(1.2), CalibrationSource::kGiven, {}, [&](const CameraParameters& camera, int) {
          last = camera;
          const bool is_silent = ++runs >= silent_from;
          const CameraModel asked =
              is_silent ? CameraModel(camera) : CameraModel(with_focal(runs % 2 ? 1.05 : 0.95));
          map = is_silent ? map_of({Rigid3(), camera_at({0, 0, 0.01}, 0)}, truth, CameraModel(camera))
                          : map_of(round_about(), asked, CameraModel(camera));
          return &map;
        });
    EXPECT_EQ(found.camera, last) << silent_from;
    EXPECT_EQ(found.runs, runs);
  }
}

// A recording for which every camera with a focal length of at least `wrong_from` times the true one gives a
// wrong map that suggests an even longer one.
class RunawayRecording {
 public:
  explicit RunawayRecording(double wrong_from) : wrong_from_(wrong_from) {}

  const Map* operator()(const CameraParameters& camera) {
    const CameraModel truth = synthetic_camera();
    const double factor = camera.fx / truth.parameters().fx;
    const CameraModel asked = factor < wrong_from_ ? truth : CameraModel(with_focal(1.07 * factor));
    map_ = map_of(round_about(), asked, CameraModel(camera));
    return &map_;
  }

 private:
  const double wrong_from_;
  Map map_;
};

void expect_told_as_interrupted(const SelfCalibration& found) {
  EXPECT_FALSE(found.is_near) << "nothing is to be built on it";
  ASSERT_EQ(found.warnings.size(), 1u);
  EXPECT_NE(found.warnings[0].find("was interrupted"), std::string::npos) << found.warnings[0];
}

TEST(SelfCalibration, InterruptedItKeepsTheMapThatThereIs) {
  for (const int interrupted_in : {1, 2, 3}) {
    int runs = 0;
    CameraParameters last;
    CameraRefinementOptions options;
    options.cancel = [&] { return runs >= interrupted_in; };
    RunawayRecording recording(10);
    const SelfCalibration found = calibrate_by_tracking(with_focal(1.3), CalibrationSource::kGuessed, options,
                                                        [&](const CameraParameters& camera, int) {
                                                          last = camera;
                                                          ++runs;
                                                          return recording(camera);
                                                        });
    EXPECT_EQ(runs, interrupted_in) << "another would read no image";
    EXPECT_EQ(found.camera, last);
    EXPECT_EQ(found.source, interrupted_in == 1 ? CalibrationSource::kGuessed : CalibrationSource::kRefined);
    EXPECT_TRUE(std::isinf(found.last.focal_sigma)) << "nothing has told it";
    expect_told_as_interrupted(found);
  }
}

TEST(SelfCalibration, InterruptedWithATrialFocalLengthItIsAGuess) {
  const CameraParameters start = with_focal(1);
  CameraParameters last = start;
  CameraRefinementOptions options;
  options.cancel = [&] { return last.fx < 0.8 * start.fx; };
  RunawayRecording recording(0);
  const SelfCalibration found = calibrate_by_tracking(start, CalibrationSource::kGiven, options,
                                                      [&](const CameraParameters& camera, int) {
                                                        last = camera;
                                                        return recording(camera);
                                                      });
  EXPECT_EQ(last, with_focal(0.7)) << "or it was not interrupted with a trial";
  EXPECT_EQ(found.camera, last);
  EXPECT_EQ(found.source, CalibrationSource::kGuessed) << "no map has asked for it";
  expect_told_as_interrupted(found);
}

// The interruption comes during the camera refinement of a map, as late as possible before another run.
TEST(SelfCalibration, InterruptedBeforeARunItBeginsNone) {
  const CameraModel truth = synthetic_camera();
  std::vector<int> asked_before_run;
  Map map;
  int asked = 0, interrupted_at = 0;  // 0: never
  CameraParameters last;
  CameraRefinementOptions options;
  options.cancel = [&] { return ++asked >= interrupted_at && interrupted_at > 0; };
  const auto calibrate = [&] {
    asked = 0;
    asked_before_run.clear();
    return calibrate_by_tracking(with_focal(0.7), CalibrationSource::kGuessed, options,
                                 [&](const CameraParameters& camera, int) {
                                   asked_before_run.push_back(asked);
                                   last = camera;
                                   map = map_of(round_about(), truth, CameraModel(camera), kFewPoints);
                                   return &map;
                                 });
  };
  const SelfCalibration whole = calibrate();
  ASSERT_NE(whole.camera, with_focal(0.7)) << "it was not guessed anew";
  const std::vector<int> asked_in_whole = asked_before_run;
  ASSERT_GE(asked_in_whole.size(), 3u);
  for (std::size_t run = 1; run < asked_in_whole.size(); ++run) {
    interrupted_at = asked_in_whole[run];
    const SelfCalibration found = calibrate();
    EXPECT_EQ(asked_before_run.size(), run) << "one more loses the map that there is";
    EXPECT_EQ(found.camera, last);
    expect_told_as_interrupted(found);
  }
}

TEST(SelfCalibration, AStartFromWhichItRunsAwayIsLeftForAnother) {
  RunawayRecording recording(1.1);
  CameraParameters last;
  const SelfCalibration found = calibrate_by_tracking(with_focal(1.3), CalibrationSource::kGiven, {},
                                                      [&](const CameraParameters& camera, int) {
                                                        last = camera;
                                                        return recording(camera);
                                                      });
  EXPECT_NEAR(found.camera.fx / synthetic_camera().parameters().fx, 1, 0.01);
  EXPECT_EQ(found.source, CalibrationSource::kRefined);
  EXPECT_TRUE(found.is_near);
  EXPECT_TRUE(found.warnings.empty());
  EXPECT_EQ(found.camera, last);
}

TEST(SelfCalibration, WhatRunsAwayFromEveryStartIsNotSettled) {
  RunawayRecording recording(0);
  const SelfCalibration found =
      calibrate_by_tracking(with_focal(1), CalibrationSource::kGiven, {},
                            [&](const CameraParameters& camera, int) { return recording(camera); });
  EXPECT_FALSE(found.is_near);
  ASSERT_EQ(found.warnings.size(), 1u);
  EXPECT_NE(found.warnings[0].find("have not converged"), std::string::npos) << found.warnings[0];
}

}  // namespace
}  // namespace mono_pose_tracker
