#pragma once

#include <cstddef>
#include <cstdlib>
#include <new>

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

}  // namespace mono_pose_tracker
