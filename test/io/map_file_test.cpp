#include "mono_pose_tracker/io/map_file.h"

#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <iterator>
#include <limits>

#include "common/time_stamp.h"
#include "support/expect_error.h"
#include "support/synthetic_map.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

constexpr std::size_t kVersionAt = 8;  // bytes

// The file of synthetic_saved_maps, once.
const std::string& file_content() {
  static const std::string content = [] {
    TemporaryFolder folder;
    write_map_file(folder / "a.map", synthetic_saved_maps());
    return folder.read("a.map");
  }();
  return content;
}

// A file that the program wrote when version 1 was the newest: a simulated room, 160x120.
const std::string& version_1_content() {
  static const std::string content = [] {
    std::ifstream stream(TEST_DATA "/map_version_1.map", std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  }();
  return content;
}

void expect_same_image(const ImageFeatures& image, const ImageFeatures& expected) {
  ASSERT_EQ(image.size(), expected.size());
  EXPECT_EQ(image.camera.parameters(), expected.camera.parameters());
  EXPECT_EQ(cv::norm(image.set.descriptors, expected.set.descriptors, cv::NORM_INF), 0);
  for (int i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(image.set.features[i].pixel, expected.set.features[i].pixel);
    EXPECT_EQ(image.set.bearings[i], expected.set.bearings[i]);
    EXPECT_EQ(image.pixel_from_bearing[i], expected.pixel_from_bearing[i]);
    EXPECT_EQ(image.sigma_px[i], expected.sigma_px[i]);
    EXPECT_EQ(image.color_rgb[i], expected.color_rgb[i]);
  }
}

void expect_same_map(const Map& map, const Map& expected) {
  EXPECT_EQ(map.scale_source(), expected.scale_source());
  ASSERT_EQ(map.keyframes().size(), expected.keyframes().size());
  for (const auto& [id, keyframe] : expected.keyframes()) {
    const Keyframe& other = *map.keyframe(id);
    EXPECT_EQ(other.frame_index, keyframe.frame_index);
    EXPECT_EQ(other.stamp_ns, keyframe.stamp_ns);
    EXPECT_EQ(other.camera_from_map.translation, keyframe.camera_from_map.translation);
    EXPECT_EQ(other.camera_from_map.rotation.coeffs(), keyframe.camera_from_map.rotation.coeffs());
    EXPECT_EQ(other.landmark_of_feature, keyframe.landmark_of_feature);
    expect_same_image(*other.image, *keyframe.image);
  }
  ASSERT_EQ(map.landmark_ids(), expected.landmark_ids());
  for (const auto& [id, landmark] : expected.landmarks()) {
    EXPECT_EQ(map.landmark(id)->x_in_map, landmark.x_in_map);
    EXPECT_EQ(map.landmark(id)->created_by, landmark.created_by);
  }
  Rigid3 was, is;
  ASSERT_TRUE(expected.camera_from_map(1, &was));
  ASSERT_TRUE(map.camera_from_map(1, &is)) << "a removed keyframe is still known";
  EXPECT_EQ(was.translation, is.translation);
}

TEST(MapFile, GivesBackWhatWasWritten) {
  TemporaryFolder folder;
  const SavedMaps saved = synthetic_saved_maps();
  write_map_file(folder / "a.map", saved);
  const SavedMaps read = read_map_file(folder / "a.map", "root_sift");
  EXPECT_EQ(read.descriptor, saved.descriptor);
  ASSERT_EQ(read.sessions.size(), saved.sessions.size());
  for (std::size_t i = 0; i < saved.sessions.size(); ++i) {
    EXPECT_EQ(read.sessions[i].camera, saved.sessions[i].camera);
    EXPECT_EQ(read.sessions[i].first_frame, saved.sessions[i].first_frame);
    EXPECT_EQ(read.sessions[i].frames, saved.sessions[i].frames);
  }
  ASSERT_EQ(read.maps.size(), saved.maps.size());
  for (std::size_t i = 0; i < saved.maps.size(); ++i) {
    read.maps[i].check();
    expect_same_map(read.maps[i], saved.maps[i]);
  }
}

TEST(MapFile, WritingWhatWasReadGivesTheSameBytes) {
  TemporaryFolder folder;
  folder.write("a.map", file_content());
  write_map_file(folder / "b.map", read_map_file(folder / "a.map", "root_sift"));
  EXPECT_EQ(folder.read("b.map"), file_content());
}

TEST(MapFile, OneMapMayBeOfSeveralSessions) {
  SavedMaps saved = synthetic_saved_maps();
  saved.maps.front().merge(saved.maps.back(), Sim3());
  saved.maps.pop_back();
  TemporaryFolder folder;
  write_map_file(folder / "a.map", saved);
  const SavedMaps read = read_map_file(folder / "a.map", "root_sift");
  ASSERT_EQ(read.maps.size(), 1u);
  std::array<int, 2> keyframes{};
  for (const auto& [id, keyframe] : read.maps[0].keyframes()) {
    const int session = read.sessions[1].holds(keyframe.frame_index) ? 1 : 0;
    ++keyframes[session];
    EXPECT_EQ(keyframe.image->camera.parameters(), synthetic_camera_of(session));
  }
  EXPECT_EQ(keyframes, (std::array<int, 2>{3, 3}));
}

TEST(MapFile, FramesOfNoSessionAreNotWritten) {
  SavedMaps saved = synthetic_saved_maps();
  saved.sessions.pop_back();
  TemporaryFolder folder;
  expect_error<std::invalid_argument>([&] { write_map_file(folder / "a.map", saved); },
                                      {"belongs to no session"});
  saved.maps.clear();
  expect_error<std::invalid_argument>([&] { write_map_file(folder / "a.map", saved); }, {"no map"});
}

TEST(MapFile, WhatComesNextIsCountedFromZero) {
  SavedMaps saved = synthetic_saved_maps();
  const std::int64_t first = saved.maps[1].keyframes().begin()->second.frame_index;
  saved.end_before_zero();
  EXPECT_EQ(saved.sessions[0].first_frame, -40);
  EXPECT_EQ(saved.sessions[1].first_frame, -20);
  EXPECT_EQ(saved.maps[1].keyframes().begin()->second.frame_index, first - 40);
}

// What the test of the tracker goes on in.
TEST(MapFile, Version1IsRead) {
  const SavedMaps read = parse_maps(version_1_content(), "root_sift");
  ASSERT_EQ(read.maps.size(), 1u);
  const Map& map = read.maps[0];
  map.check();
  EXPECT_EQ(map.keyframes().size(), 6u);
  EXPECT_EQ(map.landmarks().size(), 86u);
  EXPECT_EQ(map.scale_source(), ScaleSource::kMapUnits);
  ASSERT_EQ(read.sessions.size(), 1u);
  EXPECT_EQ(read.sessions[0].camera.width, 160);
  EXPECT_EQ(read.sessions[0].camera, map.keyframes().begin()->second.image->camera.parameters());
  for (const auto& entry : map.keyframes()) EXPECT_TRUE(read.sessions[0].holds(entry.second.frame_index));
  TemporaryFolder folder;
  write_map_file(folder / "a.map", read);
  EXPECT_EQ(folder.read("a.map")[kVersionAt], 2) << "written as what is the newest now";
  EXPECT_EQ(read_map_file(folder / "a.map", "root_sift").maps[0].landmark_ids(), map.landmark_ids());
}

TEST(MapFile, EveryTruncationIsRefused) {
  for (const std::string& whole : {file_content(), version_1_content()}) {
    // Each byte of what is short; of a file as long as the fixture each that ends or begins something is near
    // its end or beginning, and a prime number of steps meets the rest.
    const std::size_t step = whole.size() < 50'000 ? 1 : 37;
    const std::string_view content = whole;
    for (std::size_t size = 0; size < content.size(); size += size < 2000 ? 1 : step) {
      EXPECT_THROW(parse_maps(content.substr(0, size), "root_sift"), std::runtime_error) << size << " bytes";
    }
    EXPECT_THROW(parse_maps(content.substr(0, content.size() - 1), "root_sift"), std::runtime_error);
  }
  TemporaryFolder folder;
  const std::string path = folder.write("a.map", file_content().substr(0, file_content().size() - 1));
  expect_error([&] { read_map_file(path, "root_sift"); }, {path, "truncated"});
}

TEST(MapFile, EveryFlippedBitIsRefused) {
  Random random(7);
  for (const std::string& whole : {file_content(), version_1_content()}) {
    for (int trial = 0; trial < 1000; ++trial) {
      std::string content = whole;
      // A third of them in the heads, which are few bytes.
      const std::size_t range = trial % 3 == 0 ? 300 : content.size();
      const std::size_t at = random.index(static_cast<std::uint32_t>(range));
      content[at] = static_cast<char>(content[at] ^ (1 << random.index(8)));
      expect_error([&] { parse_maps(content, "root_sift"); }, {"is "});
    }
  }
}

TEST(MapFile, WhatFollowsTheEndIsRefused) {
  TemporaryFolder folder;
  const std::string path = folder.write("a.map", file_content() + "x");
  expect_error([&] { read_map_file(path, "root_sift"); }, {path, "damaged"});
}

TEST(MapFile, WhatIsNoMapIsNamed) {
  TemporaryFolder folder;
  const auto refused = [&](const std::string& path, std::initializer_list<std::string> parts) {
    expect_error([&] { read_map_file(path, "root_sift"); }, parts);
  };
  const std::string text = folder.write("a.txt", "no map at all, but some text that is long enough");
  refused(text, {text, "is not a map file"});
  refused(folder / "none.map", {folder / "none.map", "No such file"});
  refused(folder.path(), {folder.path(), "not a regular file"});
  refused("/dev/zero", {"/dev/zero", "not a regular file"});
  std::string content = file_content();
  for (const char version : {0, 3}) {
    content[kVersionAt] = version;
    const std::string other = folder.write("b.map", content);
    refused(other, {other, "is of version " + std::to_string(version) + ", expected 1 or 2"});
  }
}

// Indices are counted on and shifted: at the end of their type that would overflow.
TEST(MapFile, FrameNumbersAtTheEndOfTheirTypeAreRefused) {
  TemporaryFolder folder;
  for (const std::int64_t shift : {std::int64_t{1} << 62, -(std::int64_t{1} << 62)}) {
    SavedMaps saved = synthetic_saved_maps();
    for (Map& map : saved.maps) map.shift_frame_indices(shift);
    for (MapSession& session : saved.sessions) session.first_frame += shift;
    write_map_file(folder / "a.map", saved);
    expect_error([&] { read_map_file(folder / "a.map", "root_sift"); }, {"a.map", "a frame index"});
  }
}

// They are subtracted from each other.
TEST(MapFile, TimeStampsAtTheEndOfTheirTypeAreRefused) {
  TemporaryFolder folder;
  for (const std::int64_t stamp_ns :
       {kMaxStampNs, kMaxStampNs + 1, std::numeric_limits<std::int64_t>::min()}) {
    SavedMaps saved = synthetic_saved_maps();
    Map& map = saved.maps.back();
    const Keyframe& last = map.keyframes().rbegin()->second;
    map.add_keyframe(last.frame_index, stamp_ns, last.camera_from_map, last.image);
    write_map_file(folder / "a.map", saved);
    if (is_stamp(stamp_ns)) {
      EXPECT_NO_THROW(read_map_file(folder / "a.map", "root_sift"));
    } else {
      expect_error([&] { read_map_file(folder / "a.map", "root_sift"); }, {"a.map", "a time stamp"});
    }
  }
}

TEST(MapFile, SessionsThatCantBeAreRefused) {
  TemporaryFolder folder;
  const auto refused = [&](const SavedMaps& saved, const std::string& why) {
    write_map_file(folder / "a.map", saved);
    expect_error([&] { read_map_file(folder / "a.map", "root_sift"); }, {"is inconsistent", why});
  };
  SavedMaps saved = synthetic_saved_maps();
  saved.sessions[1].first_frame -= 1;
  refused(saved, "overlap");
  saved = synthetic_saved_maps();
  saved.sessions[0].camera.width = 1 << 20;
  refused(saved, "the camera parameters are invalid");
  saved = synthetic_saved_maps();
  saved.sessions[1].camera.distortion = {1};
  refused(saved, "the camera parameters are invalid");
  saved = synthetic_saved_maps();
  saved.sessions[1].camera.width = 100;
  refused(saved, "outside the image");
}

// A distortion of a model has no more; each of the file's many cameras would ask for memory.
TEST(MapFile, CoefficientsOfNoModelAreRefused) {
  TemporaryFolder folder;
  SavedMaps saved = synthetic_saved_maps();
  saved.sessions[1].camera.distortion.assign(1000, 0);
  write_map_file(folder / "a.map", saved);
  expect_error([&] { read_map_file(folder / "a.map", "root_sift"); }, {"too many distortion coefficients"});
  // A camera without a model may have had any number of zeros.
  saved.sessions[1].camera.distortion_model.clear();
  write_map_file(folder / "a.map", saved);
  EXPECT_NO_THROW(read_map_file(folder / "a.map", "root_sift"));
}

// A map knows of each two keyframes what they share: thousands that see one landmark and nothing else are no
// map.
TEST(MapFile, KeyframesThatSeeHardlyAnythingAreRefused) {
  TemporaryFolder folder;
  SavedMaps saved = synthetic_saved_maps();
  Map& map = saved.maps.back();
  const Keyframe last = map.keyframes().rbegin()->second;
  FeatureSet one;
  one.features = {last.image->set.features[0]};
  one.descriptors = last.image->set.descriptors.rowRange(0, 1).clone();
  const auto image = restore_image_features(std::move(one), {last.image->color_rgb[0]}, last.image->camera);
  const LandmarkId landmark = map.add_landmark(Eigen::Vector3d(0, 0, 5));
  for (int i = 0; i < 2500; ++i) {
    map.add_observation(landmark,
                        map.add_keyframe(last.frame_index, last.stamp_ns, last.camera_from_map, image), 0);
  }
  write_map_file(folder / "a.map", saved);
  expect_error([&] { read_map_file(folder / "a.map", "root_sift"); }, {"too many pairs of keyframes"});
}

TEST(MapFile, IsNotWrittenIntoAPipe) {
  expect_error([] { write_map_file("/dev/null", synthetic_saved_maps()); },
               {"/dev/null", "not a regular file"});
}

TEST(MapFile, DescriptorsOfAnotherKindAreRefused) {
  TemporaryFolder folder;
  for (const std::string& content : {file_content(), version_1_content()}) {
    const std::string path = folder.write("a.map", content);
    expect_error([&] { read_map_file(path, "sift"); }, {path, "root_sift", "expected sift"});
  }
}

TEST(MapFile, AFolderThatIsNotThereIsNamed) {
  expect_error([] { write_map_file("/no/such/folder/a.map", synthetic_saved_maps()); },
               {"/no/such/folder/a.map", "cannot be written"});
}

}  // namespace
}  // namespace mono_pose_tracker
