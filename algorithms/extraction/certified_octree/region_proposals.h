// Cubes of cells that look as if they could share a point.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "algorithms/extraction/embedded_mesh/cell_blocks.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"

namespace hermesh {

/// In voxels, by the number of an active cell (CellBlocks::cell_number); or one for all.
class CellTolerances {
 public:
  explicit CellTolerances(float all) : all_(all) {}
  explicit CellTolerances(std::vector<float> by_cell) : by_cell_(std::move(by_cell)) {}
  /// Of all cells.
  float least() const { return by_cell_.empty() ? all_ : *std::ranges::min_element(by_cell_); }
  /// The least of the active cells of a cube; `first` and `side` in cells of the block.
  float least(const CellBlocks& cells, std::int32_t block, int first, int side) const;

 private:
  float all_ = 0;
  std::vector<float> by_cell_;
};

struct RegionOptions {
  CellTolerances tolerance;  ///< where it is 0 or less a cell stays alone
  double flatness = 0;  ///< how far a cube's point may be from the planes of its crossings, voxels, root mean
                        ///< square; 0: what the tolerance lets hope for
  int largest_cube = 8;  ///< cells a side: 2, 4 or 8
};

struct ProposedCube {
  Eigen::Vector3d place;   ///< of its point, rounded for the file
  Eigen::Vector3f normal;  ///< mean of those of its crossings
};

/// A cube is proposed where the surface within it is one disc with a simple border, none of its cells is near
/// a special one, and one place within it is near the planes of all its crossings for the tolerance. The
/// border is simple if each of the cube's edges is crossed once at most, and each of its faces passed at most
/// once: by a piece of border from edge to edge. One of these for each thread.
class RegionProposals {
 public:
  RegionProposals(const CellBlocks& cells, const RegionOptions& options, const FilePoints& file)
      : cells_(cells), options_(options), file_(file) {}

  /// Of a block and a level, among the cubes that are asked for. @returns a bit each; the cubes go behind
  /// those in `found`, ascending
  std::uint64_t propose(std::int32_t block, int level, std::uint64_t asked, std::vector<ProposedCube>& found);

 private:
  /// Of planes through crossings, about the middle of the block.
  struct Sum {
    /// Of products of a plane's normal and its four numbers, by row: those are how far the middle is below
    /// the plane, and the normal.
    std::array<Eigen::Array4f, 3> products;
    Eigen::Array4f normals;  ///< behind the distances' squares
    Eigen::Array4f places;   ///< behind how many they are

    void clear();
    void add(const EdgeCrossing& crossing, const Eigen::Array4f& place);
    float count() const { return places[0]; }
  };

  void read(std::int32_t block);
  template <class F>
  void for_each_crossing(F&& f);
  bool try_cube(int level, int cube, const Sum& sum, ProposedCube& result) const;
  bool is_disc(int first, int side) const;
  bool has_simple_border(int first, int side) const;
  bool find_place(const Sum& sum, int first, int side, double tolerance, Eigen::Vector3d& place) const;

  const CellBlocks& cells_;
  const RegionOptions& options_;
  const FilePoints& file_;
  std::int32_t block_ = -1;                 ///< what follows is of this one
  BlockMask free_{};                        ///< cells that may be part of a cube, active or not
  std::array<BlockMask, 3> lower_faces_{};  ///< by axis: cells whose lower face the surface passes through
  std::array<EdgeCrossing, 3 * 512> crossings_;
  std::array<Sum, 64> sums_;  ///< of a level's cubes
};

}  // namespace hermesh
