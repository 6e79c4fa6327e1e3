// A spatial index that finds the triangles that may intersect a box.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "algorithms/core/bounds.h"

namespace hermesh {

/// A hierarchical hash grid: one lattice of cells per power of two, stored in a hash table. Each triangle is
/// listed in the cells that its box overlaps, on the level whose cells are about as wide as the triangle. So
/// no triangle is in more than eight cells, however much the sizes of triangles differ.
class TriangleGrid {
 public:
  /// Inserts the triangles. `boxes` are their bounding boxes, and must outlive this object.
  explicit TriangleGrid(const std::vector<Bounds>& boxes) : boxes_(boxes), level_(boxes.size()) {
    double widths = 0.0;
    for (const Bounds& box : boxes) widths += width(box);
    const double least = std::max(1e-3, 1.5 * widths / std::max<double>(1.0, double(boxes.size())));
    std::vector<std::size_t> sizes;
    for (std::size_t t = 0; t < boxes.size(); ++t) {
      level_[t] =
          static_cast<std::uint8_t>(std::max(0, std::ilogb(std::max(1e-3, width(boxes[t])) / least) + 1));
      if (sizes.size() <= level_[t]) sizes.resize(level_[t] + 1u);
      ++sizes[level_[t]];
    }
    for (std::size_t k = 0; k < sizes.size(); ++k) levels_.emplace_back(std::ldexp(least, int(k)), sizes[k]);
    for (std::size_t t = 0; t < boxes.size(); ++t)
      levels_[level_[t]].add(static_cast<std::uint32_t>(t), boxes[t]);
  }

  int level(std::uint32_t triangle) const { return level_[triangle]; }

  /// Calls visit(other) for the triangles of level `from_level` or higher that are listed in a cell that the
  /// triangle's box overlaps. `other` may be visited several times, need not overlap the box, and may be the
  /// triangle itself. Each level from the triangle's own upwards has at most eight such cells.
  template <class Visit>
  void visit(std::uint32_t triangle, int from_level, Visit&& visit) const {
    for (auto k = static_cast<std::size_t>(from_level); k < levels_.size(); ++k)
      levels_[k].visit(boxes_[triangle], visit);
  }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  static double width(const Bounds& box) { return (box.upper - box.lower).maxCoeff(); }

  class Level {
   public:
    Level(double cell_width, std::size_t triangles)
        : scale_(1.0 / cell_width), first_(std::bit_ceil(std::max<std::size_t>(64, 2 * triangles)), kNone) {
      entries_.reserve(4 * triangles);
    }
    void add(std::uint32_t triangle, const Bounds& box) {
      for_each_slot(box, [&](std::size_t slot) {
        entries_.push_back({triangle, first_[slot]});
        first_[slot] = static_cast<std::uint32_t>(entries_.size() - 1);
      });
    }
    template <class Visit>
    void visit(const Bounds& box, Visit&& visit) const {
      if (entries_.empty()) return;
      for_each_slot(box, [&](std::size_t slot) {
        for (std::uint32_t link = first_[slot]; link != kNone; link = entries_[link].next)
          visit(entries_[link].triangle);
      });
    }

   private:
    struct Entry {
      std::uint32_t triangle, next;
    };
    template <class F>
    void for_each_slot(const Bounds& box, F&& f) const {
      std::int64_t first[3], last[3];
      for (int a = 0; a < 3; ++a) {
        first[a] = static_cast<std::int64_t>(std::floor(box.lower[a] * scale_));
        last[a] = static_cast<std::int64_t>(std::floor(box.upper[a] * scale_));
      }
      for (std::int64_t x = first[0]; x <= last[0]; ++x)
        for (std::int64_t y = first[1]; y <= last[1]; ++y)
          for (std::int64_t z = first[2]; z <= last[2]; ++z) f(slot(x, y, z));
    }
    /// Returns the slot of a cell's list. Two cells may share a slot.
    std::size_t slot(std::int64_t x, std::int64_t y, std::int64_t z) const {
      std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15u;
      h ^= static_cast<std::uint64_t>(y) * 0xc2b2ae3d27d4eb4fu + (h >> 29);
      h ^= static_cast<std::uint64_t>(z) * 0x165667b19e3779f9u + (h >> 32);
      h *= 0x9e3779b97f4a7c15u;
      return static_cast<std::size_t>(h >> 20) & (first_.size() - 1);
    }

    double scale_;
    std::vector<std::uint32_t> first_;  ///< head of each list among the entries, by slot
    std::vector<Entry> entries_;
  };

  const std::vector<Bounds>& boxes_;
  std::vector<std::uint8_t> level_;  ///< level of each triangle
  std::vector<Level> levels_;
};

}  // namespace hermesh
