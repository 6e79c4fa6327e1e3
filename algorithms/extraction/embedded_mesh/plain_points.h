// The points of the cells about a block's edges, looked up once for all of them.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "algorithms/extraction/embedded_mesh/cell_blocks.h"

namespace hermesh {

/// The points of the plain cells in and just below a block: cells with one sheet, no ambiguous face and no
/// cut. One object serves many blocks, one after another.
class PlainPoints {
 public:
  /// Looks up the points for the edges of a block.
  void read(const CellBlocks& cells, std::int32_t block) {
    for (int slot = 0; slot < 8; ++slot) {
      const int d[3] = {slot & 1, (slot >> 1) & 1, slot >> 2};  // downwards
      const std::int32_t there =
          cells.source(block).neighbours[static_cast<std::size_t>(neighbour_slot(-d[0], -d[1], -d[2]))];
      if (there < 0) continue;
      const std::uint64_t rows = last_layers(d[1], d[2]);
      const CellBlocks::Block& own = cells[there];
      for (int x = d[0] ? 7 : 0; x < 8; ++x)
        for (std::uint64_t word = own.active[static_cast<std::size_t>(x)] & rows; word != 0;
             word &= word - 1) {
          const int bit = std::countr_zero(word), cell = 64 * x + bit;
          point_[at(x - 8 * d[0], (bit >> 3) - 8 * d[1], (bit & 7) - 8 * d[2])] =
              cells.is_plain(there, cell) ? own.first_point + rank_of(own, cell) : kNone;
        }
    }
  }
  /// Sets `points` as CellBlocks::plain_points() does, for a crossing edge of the block that was read; false
  /// where one of the four cells is not plain.
  bool around(const CellBlocks::Edge& edge, std::array<std::uint32_t, 4>& points) const {
    constexpr std::size_t kStep[3] = {81, 9, 1};
    const std::size_t first = at(edge.sample >> 6, (edge.sample >> 3) & 7, edge.sample & 7);
    const std::size_t u = kStep[(edge.axis + 1) % 3], v = kStep[(edge.axis + 2) % 3];
    points = {point_[first - u - v], point_[first - v], point_[first], point_[first - u]};
    return points[0] != kNone && points[1] != kNone && points[2] != kNone && points[3] != kNone;
  }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  static std::size_t at(int x, int y, int z) {
    return static_cast<std::size_t>(81 * (x + 1) + 9 * (y + 1) + z + 1);
  }
  std::array<std::uint32_t, 729> point_;  ///< points of cells from −1 to 7 along each axis; only those about
                                          ///< crossing edges mean something
};

}  // namespace hermesh
