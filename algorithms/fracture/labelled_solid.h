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

/// An integer for each sample of a fixed list of blocks. A block of one value takes 16 bytes, any other 2
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
  /// Sets all values of a block, which is stored as one value if they are equal. Different blocks may be
  /// written by different threads, by assign() and by set().
  void assign(std::int32_t block, const Values& values);
  void set(std::int32_t block, int sample, std::uint32_t value);

  std::size_t memory_bytes() const;

 private:
  std::vector<std::uint32_t> uniform_;
  std::vector<std::unique_ptr<Values>> values_;
};

/// A solid as blocks of samples, with the code that the cutters give each sample and the piece that it
/// belongs to.
struct LabelledSolid {
  IndexToWorld placement;
  /// Each block that holds an inside sample, and the seven below it, so that every cell with an inside corner
  /// begins in one of them; ascending. Samples of no block are outside. In each block `leaf` is that of
  /// the Hermite data, and `crossing` is empty until a LabelledGrid is made.
  HermiteView::Blocks blocks;
  /// The cutters' code of each sample: 0 outside, else 1 + its index in `code_values`. Repairs and merges
  /// change labels, never codes.
  LabelField codes;
  std::vector<CutCode> code_values;    ///< codes that occur, ascending
  LabelField labels;                   ///< each sample's piece, from 1 on; 0 outside
  std::vector<std::uint32_t> code_of;  ///< the code, as in `codes`, that each piece is named after; [0] is 0

  std::uint32_t piece_count() const { return static_cast<std::uint32_t>(code_of.size()) - 1; }
  std::uint64_t samples = 0;  ///< how many samples are inside

  /// A sample, which is outside where no block holds it, or the cell whose first corner it is.
  using Place = LatticePlace;
  /// Encodes a Place as one number; the numbers have the same order as the Places.
  static std::uint64_t key(const Place& at) {
    return static_cast<std::uint64_t>(at.block) << 9 | static_cast<std::uint64_t>(at.sample);
  }
  /// Keys of cells that must have one sheet if they are joints (label_repair.h), because polygons met where
  /// they had several.
  std::set<std::uint64_t> one_sheet;
  /// An ambiguous face whose two inside corners the surface of the whole solid joins across the face.
  struct JoinedFace {
    std::array<Place, 2> samples;  ///< the inside corners
    std::array<Place, 2> cells;    ///< on either side of the face
    bool touches = false;  ///< the corners' parts of the solid have nothing but an edge in common there
  };
  std::vector<JoinedFace> joined_faces;  ///< empty until find_joined_faces() of labelled_grid.h fills it

  /// Returns the sample at local coordinates of a block, each from −8 to 15, in the block or one next to it.
  Place locate(std::int32_t block, int x, int y, int z) const {
    return hermesh::locate(blocks[static_cast<std::size_t>(block)].neighbours, x, y, z);
  }
  /// Returns the label of a sample; 0 if there is no block.
  std::uint32_t label(const Place& at) const { return at.block < 0 ? 0 : labels(at.block, at.sample); }
  std::uint32_t label(std::int32_t block, int x, int y, int z) const { return label(locate(block, x, y, z)); }
  /// Returns the index coordinates of a block's sample.
  std::array<std::int32_t, 3> index(std::int32_t block, int sample) const {
    const auto& lower = blocks[static_cast<std::size_t>(block)].lower;
    return {lower[0] + (sample >> 6), lower[1] + ((sample >> 3) & 7), lower[2] + (sample & 7)};
  }
};

/// Returns the given blocks, by their first samples, and the seven below each, in which cells with a corner
/// in it begin; ascending, each once.
std::vector<std::array<std::int32_t, 3>> with_those_below(
    const std::vector<std::array<std::int32_t, 3>>& blocks);

/// Labels, or codes, of a block's samples and of the layers one step beyond along each axis: sample (x, y,
/// z), each from 0 to 8, is at 81x + 9y + z.
using LabelCube = std::array<std::uint32_t, 729>;
/// Fills the cube from a field of the solid. Returns false, with the cube not filled, if all its values are
/// one.
bool gather_labels(const LabelledSolid& solid, const LabelField& field, std::int32_t block, LabelCube& cube);
/// Returns the labels of the corners of one of the block's 512 cells.
CornerLabels labels_in(const LabelCube& cube, int cell);

/// Returns the blocks of a solid, with all inside samples of one code and one piece. @throws Error if the
/// solid is infinite; Cancelled.
LabelledSolid whole_solid(const FloatHermite& hermite, RunContext& context);

/// Asks the cutters for the code of each inside sample, and makes the samples of each code one piece. Fills
/// in `codes`, `code_values`, `labels` and `code_of`. @throws Cancelled.
void label_by_codes(LabelledSolid& solid, const Cutters& cutters, RunContext& context);

}  // namespace hermesh
