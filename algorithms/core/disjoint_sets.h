// Numbers that are joined into sets.
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace hermesh {

/// Disjoint sets of the numbers 0 to n − 1. The lowest number of a set stands for it, so that which one does
/// is independent of the order of the calls.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t n = 0) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::size_t size() const { return parent_.size(); }
  /// The number that stands for the set of `i`. Each call halves the paths that it walks.
  std::uint32_t find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  /// Unites the sets of `a` and `b`; the result stands for the union.
  std::uint32_t join(std::uint32_t a, std::uint32_t b) {
    a = find(a), b = find(b);
    return parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace hermesh
