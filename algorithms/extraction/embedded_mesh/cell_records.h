// The crossings around the cells of a block, in the layout of the vector code.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "algorithms/extraction/dual_contouring/kernels/leaf_kernels.h"
#include "algorithms/extraction/embedded_mesh/cell_blocks.h"

namespace hermesh {

/// The crossings of all edges of a block's cells in the layout of the vector code (leaf_kernels::RecordCube).
/// One object serves many blocks in turn.
class CellRecords {
 public:
  /// Reads the crossings of a block and of the lower layers of the blocks above. Returns false if a normal is
  /// not of unit length, as in data without normals. `near_ends` receives the block's cells with a crossing
  /// nearer to an end of its edge than margin(), except for cells that are active because of other blocks.
  bool read(const CellBlocks& cells, std::int32_t block, BlockMask& near_ends) {
    near_ends = {};
    // The array is large and mostly empty: only entries of the previous block are cleared.
    for (const int number : written_) std::fill_n(records_[number].data(), 4, 0.0f);
    written_.clear();
    bool all_unit = true;
    cells.grid().crossings(block, own_.data());
    const EdgeCrossing* next = own_.data();
    // Slot 0 is the block itself. In a block above, the cells have edges that start in the adjacent layer,
    // and none along an axis by which that block lies above.
    for (int slot = 0; slot < 8; ++slot) {
      const int d[3] = {slot & 1, (slot >> 1) & 1, slot >> 2};
      const std::int32_t there = cells.source(block).neighbours[neighbour_slot(d[0], d[1], d[2])];
      if (there < 0) continue;
      const std::uint64_t rows = first_layers(d[1], d[2]);
      for (int axis = 0; axis < 3; ++axis) {
        if (d[axis]) continue;
        for (int x = 0; x < (d[0] ? 1 : 8); ++x)
          for (std::uint64_t word = cells.source(there).crossing[axis][x] & rows; word != 0;
               word &= word - 1) {
            const int bit = std::countr_zero(word);
            const EdgeCrossing crossing =
                slot == 0 ? *next++ : cells.grid().crossing(there, 64 * x + bit, axis);
            const auto& n = crossing.normal;
            const int number = leaf_kernels::RecordCube::number(axis, x + 8 * d[0], (bit >> 3) + 8 * d[1],
                                                                (bit & 7) + 8 * d[2]);
            written_.push_back(number);
            if (std::abs(crossing.offset - 0.5f) > 0.5 - cells.margin())
              mark_cells(axis, x + 8 * d[0], (bit >> 3) + 8 * d[1], (bit & 7) + 8 * d[2], near_ends);
            records_[number] = {
                static_cast<float>(std::clamp(double(crossing.offset), cells.margin(), 1.0 - cells.margin())),
                n[axis], n[(axis + 1) % 3], n[(axis + 2) % 3]};
            all_unit = all_unit && n[0] * n[0] + n[1] * n[1] + n[2] * n[2] > 0.5f;
          }
      }
    }
    return all_unit;
  }
  const float (*data() const)[4] { return reinterpret_cast<const float(*)[4]>(records_.data()); }

 private:
  /// Marks those of the four cells around an edge that are in the block.
  static void mark_cells(int axis, int x, int y, int z, BlockMask& cells) {
    for (const auto& [u, v] : kAroundEdge) {
      int at[3] = {x, y, z};
      at[(axis + 1) % 3] += u;
      at[(axis + 2) % 3] += v;
      if (((at[0] | at[1] | at[2]) & ~7) == 0) set_bit(cells, sample_index(at[0], at[1], at[2]));
    }
  }

  std::vector<std::array<float, 4>> records_ =
      std::vector<std::array<float, 4>>(leaf_kernels::RecordCube::kAll);
  std::vector<int> written_;
  std::vector<EdgeCrossing> own_ = std::vector<EdgeCrossing>(3 * 512);  ///< the block's
};

}  // namespace hermesh
