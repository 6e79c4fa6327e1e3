// Ranges of equal items in a sorted sequence.
#pragma once

#include <cstddef>
#include <span>

namespace hermesh {

/// Calls f(range) for each maximal range of adjacent items that equal the range's first, in order.
template <class T, class Equal, class F>
void for_groups(std::span<const T> items, Equal&& equal, F&& f) {
  for (std::size_t begin = 0, end; begin < items.size(); begin = end) {
    for (end = begin + 1; end < items.size() && equal(items[begin], items[end]);) ++end;
    f(items.subspan(begin, end - begin));
  }
}

}  // namespace hermesh
