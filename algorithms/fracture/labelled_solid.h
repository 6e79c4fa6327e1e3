// A solid's samples with the number of the piece that each belongs to.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <set>
#include <span>
#include <vector>

#include "algorithms/fracture/cutters.h"
#include "algorithms/fracture/label_sheets.h"
#include "algorithms/hermite/hermite_view.h"
#include "algorithms/hermite/sparse_hermite.h"

namespace hermesh {

/// A whole number for each sample of a fixed list of blocks. A block of one value takes 16 bytes, any other 2
/// KiB: the inside of a solid is mostly of one piece.
class LabelField {
 public:
  using Values = std::array<std::uint32_t, 512>;

  LabelField() = default;
  explicit LabelField(std::size_t blocks) : uniform_(blocks), values_(blocks) {}

  std::uint32_t operator()(std::int32_t block, int sample) const {
    const auto& values = values_[static_cast<std::size_t>(block)];
    return values ? (*values)[static_cast<std::size_t>(sample)] : uniform_[static_cast<std::size_t>(block)];
  }
  bool is_uniform(std::int32_t block) const { return !values_[static_cast<std::size_t>(block)]; }
  /// Different blocks may be written by different threads.
  void assign(std::int32_t block, const Values& values);
  void set(std::int32_t block, int sample, std::uint32_t value);

  std::size_t memory_bytes() const;

 private:
  std::vector<std::uint32_t> uniform_;
  std::vector<std::unique_ptr<Values>> values_;
};

struct LabelledSolid {
  IndexToWorld placement;
  /// Each block that holds an inside sample, and the seven below it, so that every cell with an inside corner
  /// begins in one of them; ascending. What is in no block is outside. `leaf` is the number of the block, −1
  /// nowhere, and `crossing` is empty until a LabelledGrid is made.
  HermiteView::Blocks blocks;
  std::vector<std::int32_t> leaf_of;  ///< by block the leaf of the Hermite data, −1 for none
  /// What the cutters say of a sample: 0 outside, else 1 + its place in `code_values`. Never changed.
  LabelField codes;
  std::vector<CutCode> code_values;  ///< those that occur, ascending
  LabelField labels;                 ///< 0 outside, else the piece, from 1 on
  std::vector<std::uint32_t>
      code_of;  ///< of a piece the code that it is named after, as in `codes`; [0] is 0

  std::uint32_t piece_count() const { return static_cast<std::uint32_t>(code_of.size()) - 1; }
  std::uint64_t samples = 0;  ///< inside

  struct Place {
    std::int32_t block;  ///< −1: outside
    int sample;
  };
  /// Of a place in a block: one number for it.
  static std::uint64_t key(const Place& at) {
    return static_cast<std::uint64_t>(at.block) << 9 | static_cast<std::uint64_t>(at.sample);
  }
  /// Keys of cells that are to have one sheet if they are joints (label_repair.h), because polygons met where
  /// they had several.
  std::set<std::uint64_t> one_sheet;
  /// An ambiguous face of which the whole's surface joins the inside corners across the middle.
  struct JoinedFace {
    std::array<Place, 2> samples;  ///< the inside corners
    std::array<Place, 2> cells;    ///< on either side of the face
  };
  std::vector<JoinedFace> joined_faces;  ///< empty until find_joined_faces() of labelled_grid.h fills it

  /// Local coordinates from −8 to 15.
  Place locate(std::int32_t block, int x, int y, int z) const {
    const std::int32_t there =
        blocks[static_cast<std::size_t>(block)].neighbours[neighbour_slot(x >> 3, y >> 3, z >> 3)];
    return {there, sample_index(x & 7, y & 7, z & 7)};
  }
  std::uint32_t label(const Place& at) const { return at.block < 0 ? 0 : labels(at.block, at.sample); }
  std::uint32_t label(std::int32_t block, int x, int y, int z) const { return label(locate(block, x, y, z)); }
  std::array<std::int32_t, 3> index(std::int32_t block, int sample) const {
    const auto& lower = blocks[static_cast<std::size_t>(block)].lower;
    return {lower[0] + (sample >> 6), lower[1] + ((sample >> 3) & 7), lower[2] + (sample & 7)};
  }
};

/// Labels of a block's samples and of the layers one step beyond: 81x + 9y + z.
using LabelCube = std::array<std::uint32_t, 729>;
/// False, and the cube not filled, if all of these are one value.
bool gather_labels(const LabelledSolid& solid, const LabelField& field, std::int32_t block, LabelCube& cube);
/// Of the corners of one of the block's cells.
CornerLabels labels_in(const LabelCube& cube, int cell);

/// The blocks of a solid, all its samples of one piece. @throws Error if the solid has no end.
LabelledSolid whole_solid(const FloatHermite& hermite, RunContext& context);

/// Gives each sample the piece of its code.
void label_by_codes(LabelledSolid& solid, const Cutters& cutters, RunContext& context);

}  // namespace hermesh
