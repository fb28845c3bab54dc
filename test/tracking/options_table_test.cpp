#include "mono_pose_tracker/tracking/options_table.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>
#include <type_traits>

#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

std::string written(const TemporaryFolder& folder, const std::string& text) {
  const std::string path = folder / "tracker.yaml";
  std::ofstream(path) << text;
  return path;
}

std::string problem_of(const std::string& text) {
  const TemporaryFolder folder;
  TrackerOptions options;
  try {
    read_options_yaml(written(folder, text), &options);
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "";
}

TEST(OptionsTable, DefaultsAreInRangeAndKeysAreUnique) {
  TrackerOptions options;
  std::set<std::string> keys;
  for (const OptionEntry& entry : option_table(&options)) {
    EXPECT_TRUE(is_in_range(entry)) << entry.key;
    EXPECT_TRUE(keys.insert(entry.key).second) << entry.key;
  }
  EXPECT_NO_THROW(options.validate());
}

// config/default.yaml is the manual: it names every option with its default.
TEST(OptionsTable, TheManualHoldsTheDefaults) {
  const std::string manual = (std::filesystem::path(__FILE__).parent_path() / "../../config/default.yaml")
                                 .lexically_normal()
                                 .string();
  TrackerOptions defaults, read;
  for (const OptionEntry& entry : option_table(&read)) {
    std::visit([](auto* value) { *value = {}; }, entry.value);
  }
  read.sift.first_octave = 1;  // no value means auto, the default
  read.sift.sigma = 3.0f;
  read_options_yaml(manual, &read);
  const std::vector<OptionEntry> expected = option_table(&defaults), found = option_table(&read);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(option_text(found[i]), option_text(expected[i])) << expected[i].key;
  }
}

// The presets have known keys only, and each key changes something.
TEST(OptionsTable, PresetsAreValidAndDifferFromTheDefaults) {
  for (const char* name : {"fast.yaml", "accurate.yaml"}) {
    const std::filesystem::path path = std::filesystem::path(__FILE__).parent_path() / "../../config" / name;
    TrackerOptions defaults, preset;
    read_options_yaml(path.lexically_normal().string(), &preset);
    EXPECT_NO_THROW(preset.validate()) << name;
    const std::vector<OptionEntry> before = option_table(&defaults), after = option_table(&preset);
    int changed = 0, named = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      changed += option_text(before[i]) != option_text(after[i]);
    }
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
      const std::string text = line.substr(0, line.find('#'));
      const std::size_t colon = text.find(':');
      if (colon == std::string::npos || text.find_first_not_of(" ", colon + 1) == std::string::npos) continue;
      ++named;
      EXPECT_NE(line.find('#'), std::string::npos) << name << ": without a comment: " << line;
    }
    EXPECT_GT(named, 3) << name;
    EXPECT_EQ(changed, named) << name << ": a key says what the default is already";
  }
}

TEST(OptionsTable, ReadsGroupsAndFlatKeys) {
  const TemporaryFolder folder;
  TrackerOptions options;
  read_options_yaml(written(folder, "seed: 7\nsift:\n  max_features: 900\nmapping/min_parallax_deg: 1.5\n"),
                    &options);
  EXPECT_EQ(options.seed, 7u);
  EXPECT_EQ(options.sift.max_features, 900);
  EXPECT_EQ(options.mapping.min_parallax_deg, 1.5);
}

TEST(OptionsTable, AGroupOfWhichEverythingIsCommentedOutSaysNothing) {
  TrackerOptions options;
  const TemporaryFolder folder;
  read_options_yaml(folder.write("tracker.yaml", "sift:\n  # max_features: 900\nseed: 7\n"), &options);
  EXPECT_EQ(options.seed, 7u);
  expect_error([&] { read_options_yaml(folder.write("tracker.yaml", "shift:\n"), &options); }, {"shift"});
}

TEST(OptionsTable, OctaveAndSigmaAreAutoOrNumbers) {
  const TemporaryFolder folder;
  TrackerOptions options;
  read_options_yaml(written(folder, "sift:\n  first_octave: -1\n  sigma: 1.5\n"), &options);
  EXPECT_EQ(options.sift.first_octave, -1);
  EXPECT_EQ(options.sift.sigma, 1.5f);
  read_options_yaml(written(folder, "sift:\n  first_octave: auto\n"), &options);
  EXPECT_FALSE(options.sift.first_octave);
  EXPECT_EQ(options.sift.sigma, 1.5f);
  EXPECT_NE(problem_of("sift:\n  first_octave: fine\n").find("expected auto or a whole number"),
            std::string::npos);
  EXPECT_NE(problem_of("sift:\n  sigma: 0.1\n").find("expected auto or a number from 0.6 to 10"),
            std::string::npos);
}

TEST(OptionsTable, ThresholdsInPixelsGrowWithTheFeaturesPixels) {
  const TrackerOptions given;
  const TrackerOptions small = given.for_images({640, 480}, SearchPace::kLive);
  EXPECT_EQ(small.sift.first_octave, 0);
  EXPECT_EQ(small.inlier_threshold_px, given.inlier_threshold_px);
  const TrackerOptions large = given.for_images({3840, 2160}, SearchPace::kLive);
  EXPECT_EQ(large.sift.reduction, 5);
  EXPECT_EQ(large.inlier_threshold_px, 5 * given.inlier_threshold_px);
  EXPECT_EQ(large.bootstrap.min_parallax_px, 5 * given.bootstrap.min_parallax_px);
  EXPECT_EQ(large.mapping.max_reprojection_px, 5 * given.mapping.max_reprojection_px);
  CameraParameters parameters;
  parameters.width = 3840;
  parameters.height = 2160;
  parameters.fx = parameters.fy = 3000;
  const CameraModel camera(parameters);
  EXPECT_NEAR(large.mapping.transferred_px(camera), 6 * given.mapping.max_reprojection_px, 1e-9);
  EXPECT_NEAR(given.mapping.transferred_px(camera), 6 * given.mapping.max_reprojection_px, 1e-9);
  const TrackerOptions offline = given.for_images({3840, 2160}, SearchPace::kRecording);
  EXPECT_EQ(offline.inlier_threshold_px, given.inlier_threshold_px);
  TrackerOptions chosen;
  chosen.sift.first_octave = 1;
  EXPECT_EQ(chosen.for_images({3840, 2160}, SearchPace::kLive).inlier_threshold_px,
            given.inlier_threshold_px);
}

TEST(OptionsTable, EveryOptionSurvivesATripThroughText) {
  TrackerOptions a, b;
  const std::vector<OptionEntry> from = option_table(&a), to = option_table(&b);
  for (std::size_t i = 0; i < from.size(); ++i) {
    ASSERT_TRUE(set_option(to[i], option_text(from[i]))) << from[i].key;
    EXPECT_EQ(option_text(from[i]), option_text(to[i]));
  }
}

TEST(OptionsTable, NamesEveryKeyAtFaultWithWhatWasExpected) {
  const std::string problem = problem_of("sift:\n  max_featurs: 3\n  first_octave: 5\nconfidence: high\n");
  EXPECT_NE(problem.find("max_featurs, did you mean sift/max_features?"), std::string::npos) << problem;
  EXPECT_NE(problem.find("sift/first_octave = 5, expected auto or a whole number from -1 to 2"),
            std::string::npos)
      << problem;
  EXPECT_NE(problem.find("confidence = high, expected a number"), std::string::npos) << problem;
  EXPECT_EQ(problem.find('\n'), std::string::npos);
}

TEST(OptionsTable, WhatIsLikeNoKeyIsNotTakenForOne) {
  const std::string problem = problem_of("invert_tf: true\n");  // the nodelet's
  EXPECT_NE(problem.find("unknown key invert_tf"), std::string::npos) << problem;
  EXPECT_EQ(problem.find("did you mean"), std::string::npos) << problem;
}

// ROS's YAML reads 0100 as 64, and -1 is no seed.
TEST(OptionsTable, NumbersThatMeanSomethingElseAreRefused) {
  EXPECT_NE(problem_of("max_iterations: 0100\n").find("max_iterations = 0100, expected a whole number"),
            std::string::npos);
  EXPECT_NE(problem_of("max_iterations: 0100\n").find("without leading zeros"), std::string::npos);
  for (const char* text :
       {"seed: -1\n", "max_iterations: 0x100\n", "confidence: .nan\n", "confidence: 1e-999\n",
        "sift: [1, 2]\n", "sift:\n  max_features: [1]\n", "seed:\n"}) {
    EXPECT_NE(problem_of(text).find("expected"), std::string::npos) << text;
  }
}

TEST(OptionsTable, AKeyGivenTwiceIsRefused) {
  EXPECT_NE(problem_of("seed: 1\nseed: 2\n").find("the key seed a second time"), std::string::npos);
  EXPECT_NE(
      problem_of("sift:\n  sigma: 2\nsift/sigma: 1\n").find("sift/sigma is given a second time in line 3"),
      std::string::npos);
}

// Every number in the documented range must work, including its ends.
TEST(OptionsTable, TheEstimatorsTakeBothEndsOfEveryRange) {
  TrackerOptions options;
  const std::size_t number = option_table(&options).size();
  for (std::size_t i = 0; i < number; ++i) {
    for (const bool most : {false, true}) {
      TrackerOptions changed;
      const OptionEntry entry = option_table(&changed)[i];
      std::visit(
          [&](auto* value) {
            using T = std::remove_pointer_t<decltype(value)>;
            if constexpr (!std::is_same_v<T, std::string> && !std::is_same_v<T, bool>) {
              *value = static_cast<T>(most ? entry.max : entry.min);
            }
          },
          entry.value);
      EXPECT_NO_THROW(changed.validate()) << entry.key;
      EXPECT_NO_THROW(changed.ransac(600).validate()) << entry.key << " = " << option_text(entry);
      EXPECT_NO_THROW(make_sift_extractor(changed.sift)) << entry.key << " = " << option_text(entry);
      EXPECT_NO_THROW(changed.bundle.validate()) << entry.key << " = " << option_text(entry);
    }
  }
}

TEST(OptionsTable, ChangeableOptionsAreCopiedAndNoOthers) {
  TrackerOptions from, to;
  from.seed = 9;
  from.sift.sigma = 2;
  from.sift.max_features = 77;
  from.mapping.keyframe_overlap = 0.5;
  copy_changeable(from, &to);
  EXPECT_EQ(to.seed, 0u);
  EXPECT_EQ(to.sift.sigma, TrackerOptions().sift.sigma);
  EXPECT_EQ(to.sift.max_features, 77);
  EXPECT_EQ(to.mapping.keyframe_overlap, 0.5);
}

TEST(OptionsTable, SaysWhatIsNoYaml) {
  EXPECT_NE(problem_of("a: [1, 2"), "");
  TrackerOptions options;
  EXPECT_THROW(read_options_yaml("/nowhere/tracker.yaml", &options), std::runtime_error);
}

TEST(OptionsTable, NoFocalLengthMakesTheEstimatorsRefuse) {
  for (const double focal_px : {1e-30, 0.1, 1.0, 500.0, 1e30}) {
    EXPECT_NO_THROW(TrackerOptions().ransac(focal_px).validate()) << focal_px;
  }
  EXPECT_DOUBLE_EQ(TrackerOptions().ransac(500).threshold, TrackerOptions().inlier_threshold_px / 500);
}

TEST(OptionsTable, ValidateListsAllAtOnce) {
  TrackerOptions options;
  options.inlier_threshold_px = -1;
  options.bundle.max_iterations = 0;
  try {
    options.validate();
    FAIL();
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("inlier_threshold_px"), std::string::npos);
    EXPECT_NE(std::string(e.what()).find("bundle/max_iterations"), std::string::npos);
  }
}

}  // namespace
}  // namespace mono_pose_tracker
