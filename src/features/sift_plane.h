#pragma once

#include <cstddef>
#include <cstdlib>
#include <new>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace mono_pose_tracker {

/// Allocator for std::vectors that are read as a whole. The first access to a page costs a fault, and a plane
/// of an image has hundreds of pages of 4 KB. Large blocks therefore use pages of 2 MB where the system has
/// them, and the pages are requested at once (in a virtual machine that takes a third of the time).
template <typename T>
class HugePageAllocator {
 public:
  using value_type = T;
  static_assert(alignof(T) <= alignof(std::max_align_t));

  HugePageAllocator() = default;
  template <typename U>
  HugePageAllocator(const HugePageAllocator<U>&) noexcept {}

  T* allocate(std::size_t count) {
    const std::size_t bytes = count * sizeof(T);
    if (bytes < kWorth) return static_cast<T*>(::operator new(bytes));
    void* memory = nullptr;
    if (posix_memalign(&memory, bytes < kLargePage ? kPage : kLargePage, bytes) != 0) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
    // Where it is refused, pages are small; below, they come one by one.
    if (bytes >= kLargePage) madvise(memory, bytes / kLargePage * kLargePage, MADV_HUGEPAGE);
#endif
#ifdef MADV_POPULATE_WRITE
    madvise(memory, bytes / kPage * kPage, MADV_POPULATE_WRITE);
#endif
    return static_cast<T*>(memory);
  }

  void deallocate(T* memory, std::size_t count) noexcept {
    if (count * sizeof(T) < kWorth) {
      ::operator delete(memory);
    } else {
      std::free(memory);
    }
  }

 private:
  // Bytes; of fewer than 16 pages it would be more calls than faults are worth.
  static constexpr std::size_t kPage = std::size_t{4} << 10, kLargePage = std::size_t{2} << 20,
                               kWorth = 16 * kPage;
};

template <typename T, typename U>
bool operator==(const HugePageAllocator<T>&, const HugePageAllocator<U>&) {
  return true;
}
template <typename T, typename U>
bool operator!=(const HugePageAllocator<T>&, const HugePageAllocator<U>&) {
  return false;
}

constexpr int kPlaneBlock = 64;  // floats that the hot loops take at a time

/// One channel of floats. Rows are padded to whole blocks and are an odd number of blocks apart; otherwise
/// the rows of an image with a width of a power of two would share few sets of the cache. Padding is finite
/// and meaningless.
class Plane {
 public:
  void resize(int width, int height) {
    width_ = width;
    height_ = height;
    const int blocks = (width + kPlaneBlock - 1) / kPlaneBlock;
    padded_width_ = blocks * kPlaneBlock;
    stride_ = (blocks | 1) * kPlaneBlock;
    data_.resize(static_cast<std::size_t>(stride_) * height +
                 kPlaneBlock);  // hot loops read a block past a row
  }
  int width() const { return width_; }
  int height() const { return height_; }
  int padded_width() const { return padded_width_; }  // whole blocks
  int stride() const { return stride_; }
  float* row(int y) { return data_.data() + static_cast<std::size_t>(stride_) * y; }
  const float* row(int y) const { return data_.data() + static_cast<std::size_t>(stride_) * y; }

 private:
  int width_ = 0;
  int height_ = 0;
  int padded_width_ = 0;
  int stride_ = 0;
  std::vector<float, HugePageAllocator<float>> data_;
};

// The hot loops of SIFT are written on eight floats at a time, the sums of whole planes (SiftSums) on as
// many as the processor takes.
using Floats8 = float __attribute__((vector_size(32)));
using Ints8 = int __attribute__((vector_size(32)));
// The attributes are the name's: where they stand beside the type clang ignores them, and aligned moves
// crash.
using UnalignedFloats8 __attribute__((aligned(4), may_alias)) = Floats8;
static_assert(alignof(UnalignedFloats8) == 4, "rows begin anywhere");

#define MPT_SIFT_LOAD(pointer) (*reinterpret_cast<const UnalignedFloats8*>(pointer))
#define MPT_SIFT_STORE(pointer, value) (*reinterpret_cast<UnalignedFloats8*>(pointer) = (value))

using Floats4 = float __attribute__((vector_size(16)));
using UnalignedFloats4 __attribute__((aligned(4), may_alias)) = Floats4;

using Floats16 = float __attribute__((vector_size(64)));
using UnalignedFloats16 __attribute__((aligned(4), may_alias)) = Floats16;

}  // namespace mono_pose_tracker
