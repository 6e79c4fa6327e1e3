// The triangles of the uniform mesh near a position, found through the lattice.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "algorithms/core/bounds.h"
#include "algorithms/extraction/contact/triangle_contact.h"
#include "algorithms/extraction/embedded_mesh/edge_polygons.h"
#include "algorithms/extraction/embedded_mesh/uniform_points.h"

namespace hermesh {

/// The triangles of the uniform mesh by the block of their edge. Those of a block are listed on the first
/// request, from any thread.
class PolygonNeighbourhood {
 public:
  /// All arguments by reference must outlive this.
  /// @param cells cells of the lattice
  /// @param polygons forms of the edges; call forget() after a change
  /// @param points by number, including those of fanned edges; they may move
  /// @param farthest largest distance of any vertex from its cell along an axis, now or later, voxels
  PolygonNeighbourhood(const CellBlocks& cells, const EdgePolygons& polygons, const UniformPoints& points,
                       double farthest)
      : cells_(cells),
        polygons_(polygons),
        points_(points),
        reach_(1.0 + farthest + kRounding),
        lists_(cells.size()) {}
  ~PolygonNeighbourhood() { forget(); }
  PolygonNeighbourhood(const PolygonNeighbourhood&) = delete;
  PolygonNeighbourhood& operator=(const PolygonNeighbourhood&) = delete;

  /// Discards the lists, because the polygons have changed. Not concurrently with any other call.
  void forget() {
    for (auto& list : lists_) delete list.exchange(nullptr, std::memory_order_relaxed);
  }

  std::span<const Triangle> triangles_of(const CellBlocks::Edge& edge) const {
    return list_of(edge.block).triangles_of(number_of(edge));
  }
  /// Replaces the two triangles of a quad. Not while another thread reads them.
  void set_triangles(const CellBlocks::Edge& edge, const std::array<Triangle, 2>& triangles) {
    List& list = list_of(edge.block);
    std::ranges::copy(triangles, list.triangles.begin() + list.first[number_of(edge)]);
  }

  /// Calls f(edge, triangle) for all triangles whose boxes overlap `box`, which must not extend more than
  /// three voxels beyond the block. The triangles of an edge lie within `farthest` of the box of its four
  /// cells, so their edges begin at most five samples below the block or six above its last.
  template <class F>
  void for_each_near(std::int32_t block, const Bounds& box, F&& f) const {
    const Eigen::Vector3d origin = cells_.corner(block, 0);
    int first[3], last[3];
    for (int a = 0; a < 3; ++a) {
      first[a] = static_cast<int>(std::ceil(box.lower[a] - origin[a] - reach_));
      last[a] = static_cast<int>(std::floor(box.upper[a] - origin[a] + reach_));
    }
    for (int x = first[0]; x <= last[0]; ++x)
      for (int y = first[1]; y <= last[1]; ++y)
        for (int z = first[2]; z <= last[2]; z = (z | 7) + 1)
          for_each_in_row(block, x, y, z, std::min(last[2], z | 7), box, f);
  }

  Bounds box_of(const Triangle& t) const {
    Bounds box;
    for (const std::uint32_t p : t) box.add(points_[p]);
    return box;
  }

  /// Returns true if two triangles certainly intersect only in their shared corners.
  bool apart(const Triangle& a, const Triangle& b) const { return certainly_apart(a, b, points_); }

 private:
  static constexpr double kRounding = 1e-3;  // far above that of points to the file's precision

  /// The triangles of a block's crossed edges, by the number of the edge.
  struct List {
    std::vector<std::uint32_t> first;
    std::vector<Triangle> triangles;
    std::span<const Triangle> triangles_of(std::uint32_t edge) const {
      return std::span(triangles).subspan(first[edge], first[edge + 1] - first[edge]);
    }
  };

  /// Returns the number of a crossed edge in its block, in the order of CellBlocks::for_each_crossing_edge().
  std::uint32_t number_of(const CellBlocks::Edge& edge) const {
    const auto& crossing = cells_.grid().blocks()[edge.block].crossing;
    std::uint32_t before = 0;
    for (int axis = 0; axis < edge.axis; ++axis) before += count(crossing[axis]);
    return before + rank_in(crossing[edge.axis], edge.sample);
  }

  List& list_of(std::int32_t block) const {
    auto& slot = lists_[block];
    if (List* list = slot.load(std::memory_order_acquire)) return *list;
    auto made = std::make_unique<List>();
    cells_.for_each_crossing_edge(block, [&](const CellBlocks::Edge& edge) {
      made->first.push_back(static_cast<std::uint32_t>(made->triangles.size()));
      if (!test(polygons_.edges(block, edge.axis), edge.sample)) return;
      const auto add = [&](const Triangle& t) { made->triangles.push_back(t); };
      polygons_.polygons_of(
          edge,
          [&](const Quad& q) {
            add({q[0], q[1], q[2]});
            add({q[0], q[2], q[3]});
          },
          add);
    });
    made->first.push_back(static_cast<std::uint32_t>(made->triangles.size()));
    List* before = nullptr;
    if (slot.compare_exchange_strong(before, made.get(), std::memory_order_acq_rel)) return *made.release();
    return *before;  // made by another thread meanwhile
  }

  /// Calls f(edge, triangle) for the crossed edges that begin at samples z to `end` of one row of a block.
  template <class F>
  void for_each_in_row(std::int32_t block, int x, int y, int z, int end, const Bounds& box, F&& f) const {
    const CellBlocks::Cell row = cells_.locate(block, x, y, z & ~7);
    if (row.block < 0) return;
    const unsigned wanted = (2u << (end & 7)) - (1u << (z & 7));
    for (int axis = 0; axis < 3; ++axis) {
      const BlockMask& crossing = cells_.grid().blocks()[row.block].crossing[axis];
      auto bits = static_cast<unsigned>(crossing[row.cell >> 6] >> (row.cell & 63)) & wanted;
      if (bits == 0) continue;
      const List& list = list_of(row.block);
      std::uint32_t number = number_of({row.block, row.cell + std::countr_zero(bits), axis});
      for (; bits != 0; bits &= bits - 1, ++number)
        for (const Triangle& t : list.triangles_of(number))
          if (box.overlaps(box_of(t)))
            f(CellBlocks::Edge{row.block, row.cell + std::countr_zero(bits), axis}, t);
    }
  }

  const CellBlocks& cells_;
  const EdgePolygons& polygons_;
  const UniformPoints& points_;
  const double reach_;  ///< of the triangles of an edge from its first sample along an axis, voxels
  mutable std::vector<std::atomic<List*>> lists_;  ///< one per block; null until requested
};

}  // namespace hermesh
