#include "tracking/seen_images.h"

#include <gtest/gtest.h>

#include <memory>

namespace mono_pose_tracker {
namespace {

TEST(SeenImages, AShortRecordingIsKeptWhole) {
  const auto image = std::make_shared<const ImageFeatures>();
  SeenImages seen;
  for (int i = 0; i < static_cast<int>(SeenImages::kMost); ++i) seen.add(i, image);
  for (int i = 0; i < static_cast<int>(SeenImages::kMost); ++i) EXPECT_EQ(seen.find(i), image) << i;
  EXPECT_EQ(seen.find(-1), nullptr);
}

TEST(SeenImages, OfALongOneTheyAreFromAllAlongIt) {
  constexpr int kImages = 3600, kParts = 10, kPart = kImages / kParts;
  const auto image = std::make_shared<const ImageFeatures>();
  SeenImages seen;
  for (int i = 0; i < kImages; ++i) seen.add(i, image);
  int kept = 0;
  for (int part = 0; part < kParts; ++part) {
    int of_part = 0;
    for (int i = part * kPart; i < (part + 1) * kPart; ++i) of_part += seen.find(i) != nullptr;
    EXPECT_NEAR(of_part, kPart / 16, 1) << "tenth " << part;
    kept += of_part;
  }
  EXPECT_LE(kept, static_cast<int>(SeenImages::kMost));
  seen.add(1, image);
  EXPECT_EQ(seen.find(1), nullptr) << "registered again";
}

}  // namespace
}  // namespace mono_pose_tracker
