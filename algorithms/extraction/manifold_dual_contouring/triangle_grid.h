// Triangles by place, for the question which of them might touch a box.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

namespace hermesh {

struct Box3 {
  Eigen::Vector3d lower = Eigen::Vector3d::Constant(1e300), upper = Eigen::Vector3d::Constant(-1e300);
  void add(const Eigen::Vector3d& p) {
    lower = lower.cwiseMin(p);
    upper = upper.cwiseMax(p);
  }
  bool overlaps(const Box3& other) const {
    return (lower.array() <= other.upper.array()).all() && (other.lower.array() <= upper.array()).all();
  }
};

/// A lattice of cells with a list each, found by hashing. A triangle is put into every cell that its box touches, again
/// after each change. Entries out of date do no harm: the reader looks at the triangle's box as it is now.
class TriangleGrid {
 public:
  /// Of cells about as wide as the triangles.
  TriangleGrid(double cell_width, std::size_t triangles)
      : scale_(1.0 / cell_width), first_(std::bit_ceil(std::max<std::size_t>(64, 2 * triangles)), kNone) {
    entries_.reserve(4 * triangles);
  }

  void add(std::uint32_t triangle, const Box3& box) {
    for_each_cell(box, [&](std::uint32_t& first) {
      entries_.push_back({triangle, first});
      first = static_cast<std::uint32_t>(entries_.size() - 1);
    });
  }

  /// Calls visit(triangle) for those whose cells the box touches, some of them more than once, and others besides;
  /// `gone(triangle)` drops one for ever.
  template <class Gone, class Visit>
  void visit(const Box3& box, Gone&& gone, Visit&& visit) {
    for_each_cell(box, [&](std::uint32_t& first) {
      for (std::uint32_t* link = &first; *link != kNone;) {
        Entry& entry = entries_[*link];
        if (gone(entry.triangle)) {
          *link = entry.next;
        } else {
          visit(entry.triangle);
          link = &entry.next;
        }
      }
    });
  }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  struct Entry {
    std::uint32_t triangle, next;
  };

  template <class F>
  void for_each_cell(const Box3& box, F&& f) {
    std::int64_t first[3], last[3];
    for (int a = 0; a < 3; ++a) {
      first[a] = static_cast<std::int64_t>(std::floor(box.lower[a] * scale_));
      last[a] = static_cast<std::int64_t>(std::floor(box.upper[a] * scale_));
    }
    for (std::int64_t x = first[0]; x <= last[0]; ++x)
      for (std::int64_t y = first[1]; y <= last[1]; ++y)
        for (std::int64_t z = first[2]; z <= last[2]; ++z) f(first_[slot(x, y, z)]);
  }
  /// Two cells may share a list.
  std::size_t slot(std::int64_t x, std::int64_t y, std::int64_t z) const {
    std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15u;
    h ^= static_cast<std::uint64_t>(y) * 0xc2b2ae3d27d4eb4fu + (h >> 29);
    h ^= static_cast<std::uint64_t>(z) * 0x165667b19e3779f9u + (h >> 32);
    h *= 0x9e3779b97f4a7c15u;
    return static_cast<std::size_t>(h >> 20) & (first_.size() - 1);
  }

  double scale_;
  std::vector<std::uint32_t> first_;  ///< by cell: head of its list among the entries
  std::vector<Entry> entries_;
};

}  // namespace hermesh
