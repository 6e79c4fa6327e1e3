// Arrays that are written once, in parallel, directly after their allocation.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace hermesh {

/// Allocator that leaves new elements uninitialized, so that resizing touches no memory and the thread that
/// fills a page touches it first. Large arrays request huge pages: the first touch of a small page costs more
/// than filling it.
template <class T>
class LargeArrayAllocator {
 public:
  using value_type = T;
  LargeArrayAllocator() = default;
  template <class U>
  LargeArrayAllocator(const LargeArrayAllocator<U>&) {}

  T* allocate(std::size_t n) {
    const std::size_t bytes = n * sizeof(T);
    const std::size_t alignment = bytes >= kLarge ? kHugePage : alignof(std::max_align_t);
    void* memory = ::operator new (bytes, std::align_val_t{alignment});
#if defined(MADV_HUGEPAGE)
    if (bytes >= kLarge) madvise(memory, bytes, MADV_HUGEPAGE);  // only a hint: a failure has no effect
#endif
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t n) {
    const bool large = n * sizeof(T) >= kLarge;
    ::operator delete (memory, std::align_val_t{large ? kHugePage : alignof(std::max_align_t)});
  }
  template <class U>
  void construct(U* at) {
    ::new (static_cast<void*>(at)) U;
  }
  template <class U, class... Arguments>
  void construct(U* at, Arguments&&... arguments) {
    ::new (static_cast<void*>(at)) U(std::forward<Arguments>(arguments)...);
  }
  bool operator==(const LargeArrayAllocator&) const { return true; }

 private:
  static constexpr std::size_t kHugePage = std::size_t{2} << 20;
  static constexpr std::size_t kLarge =
      2 * kHugePage;  ///< below it the unused rest of the last page would be too large
};

/// Vector whose resize() leaves new elements uninitialized: T must have no default member initializer that
/// matters.
template <class T>
using LargeArray = std::vector<T, LargeArrayAllocator<T>>;

}  // namespace hermesh
