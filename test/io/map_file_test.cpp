#include "mono_pose_tracker/io/map_file.h"

#include <gtest/gtest.h>

#include "support/expect_error.h"
#include "support/synthetic_map.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

constexpr std::size_t kVersionAt = 8;  // bytes

// The file of synthetic_map, once.
const std::string& file_content() {
  static const std::string content = [] {
    TemporaryFolder folder;
    write_map_file(folder / "a.map", synthetic_origin(), synthetic_map());
    return folder.read("a.map");
  }();
  return content;
}

TEST(MapFile, GivesBackWhatWasWritten) {
  TemporaryFolder folder;
  const Map map = synthetic_map();
  write_map_file(folder / "a.map", synthetic_origin(), map);
  const Map read = read_map_file(folder / "a.map", synthetic_origin());
  read.check();
  EXPECT_EQ(read.scale_source(), ScaleSource::kMarker);
  ASSERT_EQ(read.keyframes().size(), map.keyframes().size());
  for (const auto& [id, keyframe] : map.keyframes()) {
    const Keyframe& other = *read.keyframe(id);
    EXPECT_EQ(other.frame_index, keyframe.frame_index);
    EXPECT_EQ(other.stamp_ns, keyframe.stamp_ns);
    EXPECT_EQ(other.camera_from_map.translation, keyframe.camera_from_map.translation);
    EXPECT_EQ(other.camera_from_map.rotation.coeffs(), keyframe.camera_from_map.rotation.coeffs());
    EXPECT_EQ(other.landmark_of_feature, keyframe.landmark_of_feature);
    ASSERT_EQ(other.image->size(), keyframe.image->size());
    EXPECT_EQ(cv::norm(other.image->set.descriptors, keyframe.image->set.descriptors, cv::NORM_INF), 0);
    for (int i = 0; i < keyframe.image->size(); ++i) {
      EXPECT_EQ(other.image->set.features[i].pixel, keyframe.image->set.features[i].pixel);
      EXPECT_EQ(other.image->set.bearings[i], keyframe.image->set.bearings[i]);
      EXPECT_EQ(other.image->pixel_from_bearing[i], keyframe.image->pixel_from_bearing[i]);
      EXPECT_EQ(other.image->sigma_px[i], keyframe.image->sigma_px[i]);
      EXPECT_EQ(other.image->color_rgb[i], keyframe.image->color_rgb[i]);
    }
  }
  ASSERT_EQ(read.landmark_ids(), map.landmark_ids());
  for (const auto& [id, landmark] : map.landmarks()) {
    EXPECT_EQ(read.landmark(id)->x_in_map, landmark.x_in_map);
    EXPECT_EQ(read.landmark(id)->created_by, landmark.created_by);
  }
  Rigid3 was, is;
  ASSERT_TRUE(map.camera_from_map(1, &was));
  ASSERT_TRUE(read.camera_from_map(1, &is)) << "a removed keyframe is still known";
  EXPECT_EQ(was.translation, is.translation);
}

TEST(MapFile, WritingWhatWasReadGivesTheSameBytes) {
  TemporaryFolder folder;
  folder.write("a.map", file_content());
  write_map_file(folder / "b.map", synthetic_origin(), read_map_file(folder / "a.map", synthetic_origin()));
  EXPECT_EQ(folder.read("b.map"), file_content());
}

TEST(MapFile, EveryTruncationIsRefused) {
  const std::string_view content = file_content();
  for (std::size_t size = 0; size < content.size(); ++size) {
    EXPECT_THROW(parse_map(content.substr(0, size), synthetic_origin()), std::runtime_error)
        << size << " bytes";
  }
  TemporaryFolder folder;
  const std::string path = folder.write("a.map", file_content().substr(0, file_content().size() - 1));
  expect_error([&] { read_map_file(path, synthetic_origin()); }, {path, "cut short"});
}

TEST(MapFile, EveryFlippedBitIsRefused) {
  Random random(7);
  for (int trial = 0; trial < 1000; ++trial) {
    std::string content = file_content();
    // A third of them in the heads, which are few bytes.
    const std::size_t range = trial % 3 == 0 ? 100 : content.size();
    const std::size_t at = random.index(static_cast<std::uint32_t>(range));
    content[at] = static_cast<char>(content[at] ^ (1 << random.index(8)));
    expect_error([&] { parse_map(content, synthetic_origin()); }, {"is "});
  }
}

TEST(MapFile, WhatFollowsTheEndIsRefused) {
  TemporaryFolder folder;
  const std::string path = folder.write("a.map", file_content() + "x");
  expect_error([&] { read_map_file(path, synthetic_origin()); }, {path, "damaged"});
}

TEST(MapFile, WhatIsNoMapIsNamed) {
  TemporaryFolder folder;
  const auto refused = [&](const std::string& path, std::initializer_list<std::string> parts) {
    expect_error([&] { read_map_file(path, synthetic_origin()); }, parts);
  };
  const std::string text = folder.write("a.txt", "no map at all, but some text that is long enough");
  refused(text, {text, "is no map file"});
  refused(folder / "none.map", {folder / "none.map", "No such file"});
  refused(folder.path(), {folder.path(), "no regular file"});
  refused("/dev/zero", {"/dev/zero", "no regular file"});
  std::string content = file_content();
  content[kVersionAt] = 2;
  const std::string newer = folder.write("b.map", content);
  refused(newer, {newer, "is of version 2, expected 1"});
}

// Indices are counted on and shifted: at the end of their type that would overflow.
TEST(MapFile, FrameNumbersAtTheEndOfTheirTypeAreRefused) {
  TemporaryFolder folder;
  for (const std::int64_t shift : {std::int64_t{1} << 62, -(std::int64_t{1} << 62)}) {
    Map map = synthetic_map();
    map.shift_frame_indices(shift);
    write_map_file(folder / "a.map", synthetic_origin(), map);
    expect_error([&] { read_map_file(folder / "a.map", synthetic_origin()); }, {"a.map", "a frame's number"});
  }
}

TEST(MapFile, IsNotWrittenIntoAPipe) {
  expect_error([] { write_map_file("/dev/null", synthetic_origin(), synthetic_map()); },
               {"/dev/null", "no regular file"});
}

TEST(MapFile, AnotherCameraIsRefused) {
  TemporaryFolder folder;
  const std::string path = folder.write("a.map", file_content());
  MapOrigin other = synthetic_origin();
  other.camera.fx = 500;
  expect_error([&] { read_map_file(path, other); }, {path, "another camera", "fx 600", "fx 500"});
  other = synthetic_origin();
  other.camera.distortion[0] = 0.1;
  expect_error([&] { read_map_file(path, other); }, {path, "another camera", "distortion"});
  other = synthetic_origin();
  other.descriptor = "sift";
  expect_error([&] { read_map_file(path, other); }, {path, "root_sift", "expected sift"});
}

TEST(MapFile, AFolderThatIsNotThereIsNamed) {
  expect_error([] { write_map_file("/no/such/folder/a.map", synthetic_origin(), synthetic_map()); },
               {"/no/such/folder/a.map", "cannot be written"});
}

}  // namespace
}  // namespace mono_pose_tracker
