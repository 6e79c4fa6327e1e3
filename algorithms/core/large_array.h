// Arrays that are written once, in parallel, straight after they were made.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace hermesh {

/// Allocator that leaves new elements uninitialized, so that resizing touches no memory and the first to
/// write a page is the thread that fills it. Large arrays ask for huge pages: the first touch of a small page
/// costs more than filling it.
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
    if (bytes >= kLarge) madvise(memory, bytes, MADV_HUGEPAGE);  // a wish: nothing depends on it
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
      2 * kHugePage;  ///< below it what is left of the last page would weigh too much
};

/// Vector whose resize() leaves new elements as the memory is: T must have no default member initializer that
/// matters.
template <class T>
using LargeArray = std::vector<T, LargeArrayAllocator<T>>;

}  // namespace hermesh
