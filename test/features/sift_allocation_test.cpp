// malloc and its kin, counted while a test asks for it. operator new, cv::Mat and Eigen all end there.

#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <opencv2/imgproc.hpp>

#include "mono_pose_tracker/features/sift.h"
#include "support/random_texture.h"

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

namespace {

std::atomic<bool> counting{false};
std::atomic<long> allocations{0};
std::atomic<std::size_t> allocated_bytes{0};

void note(std::size_t size) {
  if (!counting.load(std::memory_order_relaxed)) return;
  ++allocations;
  allocated_bytes += size;
}

}  // namespace

extern "C" {

void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  note(size);
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  note(count * size);
  return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) {
  note(size);
  return __libc_realloc(old, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  note(size);
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
  *out = memalign(alignment, size);
  return *out ? 0 : ENOMEM;
}

}  // extern "C"

namespace mono_pose_tracker {
namespace {

template <typename Work>
long allocations_of(const Work& work) {
  allocations = 0;
  allocated_bytes = 0;
  counting = true;
  work();
  counting = false;
  return allocations;
}

TEST(SiftAllocationTest, TheCounterSeesEveryKindOfAllocation) {
  EXPECT_GE(allocations_of([] { delete new std::vector<int>(1000); }), 1);
  EXPECT_GE(allocations_of([] { cv::Mat(100, 100, CV_8U); }), 1);
  EXPECT_EQ(allocations_of([] {}), 0);
}

class SiftWarmTest : public testing::TestWithParam<int> {};

TEST_P(SiftWarmTest, AllocatesNothingForImagesOfASizeItKnows) {
  SiftOptions options;
  options.first_octave = GetParam();
  options.max_features = 400;
  options.min_features = 400;
  const int size = options.first_octave == 2 ? 2 : 1;  // enough features
  const cv::Mat gray = random_texture(size * 322, size * 241, 1);
  cv::Mat turned;
  cv::rotate(gray, turned, cv::ROTATE_180);
  const auto extractor = make_sift_extractor(options);
  FeatureSet set, other;
  EXPECT_GT(allocations_of([&] { extractor->extract(gray, cv::Mat(), &set); }), 10);
  extractor->extract(turned, cv::Mat(), &other);
  ASSERT_GT(set.size(), 100);

  // Into a set that has room already: nothing at all.
  EXPECT_EQ(allocations_of([&] { extractor->extract(gray, cv::Mat(), &set); }), 0);
  EXPECT_EQ(allocations_of([&] { extractor->extract(turned, cv::Mat(), &other); }), 0);

  // Into a new set: what is returned, a few growing steps of it.
  FeatureSet fresh;
  const long returned = allocations_of([&] { extractor->extract(gray, cv::Mat(), &fresh); });
  EXPECT_EQ(fresh.size(), set.size());
  EXPECT_LE(returned, 3);  // features; descriptors and their header
}

// Each image is first searched as usual, and then on a finer scale.
TEST(SiftAllocationTest, ImagesOfSmallObjectsTakeThePlanesOfThoseBefore) {
  const cv::Mat gray = random_texture(322, 241, 1);
  cv::Mat mask(gray.size(), CV_8U, cv::Scalar(0));
  mask(cv::Rect(80, 60, 120, 120)) = 255;
  SiftOptions options;
  options.finer_for_small_objects = true;
  const auto extractor = make_sift_extractor(options);
  FeatureSet small, whole;
  extractor->extract(gray, mask, &small);
  options.finer_for_small_objects = false;
  make_sift_extractor(options)->extract(gray, mask, &whole);
  ASSERT_GT(small.size(), whole.size()) << "the scale is finer";
  allocations_of([&] { extractor->extract(gray, mask, &small); });
  EXPECT_LT(allocated_bytes, 100'000u) << "a plane has more";
}

INSTANTIATE_TEST_SUITE_P(FirstOctaves, SiftWarmTest, testing::Values(-1, 0, 1, 2));

}  // namespace
}  // namespace mono_pose_tracker

#endif
