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

/// Tolerances of cells in voxels, by the number of an active cell (CellBlocks::cell_number); or one for all.
class CellTolerances {
 public:
  explicit CellTolerances(float all) : all_(all) {}
  explicit CellTolerances(std::vector<float> by_cell) : by_cell_(std::move(by_cell)) {}
  /// The least of all cells' tolerances.
  float least() const { return by_cell_.empty() ? all_ : *std::ranges::min_element(by_cell_); }
  /// The least tolerance of the active cells of a cube; `first` and `side` in cells of the block.
  float least(const CellBlocks& cells, std::int32_t block, int first, int side) const;

 private:
  float all_ = 0;
  std::vector<float> by_cell_;
};

/// How cells are merged.
struct RegionOptions {
  CellTolerances tolerance;  ///< where it is 0 or less a cell stays alone
  double flatness = 0;  ///< how far a cube's point may be from the planes of its crossings, voxels, root mean
                        ///< square; 0: what the tolerance lets hope for
  int largest_cube = 8;  ///< cells a side: 2, 4 or 8
};

/// What the cells of a cube share.
struct ProposedCube {
  Eigen::Vector3d place;   ///< where its point is, rounded for the file
  Eigen::Vector3f normal;  ///< mean normal of its crossings, unit length
};

/// Proposes cubes. A cube is proposed where the surface within it is one disc with a simple border, none of
/// its cells is near a special one, and one place within it is near the planes of all its crossings for the
/// tolerance. The border is simple if each of the cube's edges is crossed once at most, and each of its faces
/// passed at most once: by a piece of border from edge to edge. (The thesis, §6.3 and §6.4, tests signs of
/// corners and middles and goes from small cubes to large ones.) One object for each thread.
class RegionProposals {
 public:
  RegionProposals(const CellBlocks& cells, const RegionOptions& options, const FilePoints& file)
      : cells_(cells), options_(options), file_(file) {}

  /// Proposes cubes of a level among those of a block that are `asked` for, a bit each, and returns which
  /// pass, a bit each. They are put behind the cubes in `found`, ascending.
  std::uint64_t propose(std::int32_t block, int level, std::uint64_t asked, std::vector<ProposedCube>& found);

 private:
  /// What the planes through a cube's crossings add up to, about the middle of the block.
  struct Sum {
    /// Products of each plane's normal and its four numbers, by row: the four numbers are how far the middle
    /// is below the plane, and the normal.
    std::array<Eigen::Array4f, 3> products;
    Eigen::Array4f normals;  ///< sum of squared distances from the middle, and of normals
    Eigen::Array4f places;   ///< number of crossings, and sum of their places

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
  std::int32_t block_ = -1;  ///< the block that what follows belongs to
  BlockMask free_{};         ///< cells that may be part of a cube, active or not
  std::array<BlockMask, 3>
      lower_faces_{};  ///< for each axis the cells whose lower face is passed by the surface
  std::array<EdgeCrossing, 3 * 512> crossings_;
  std::array<Sum, 64> sums_;  ///< one for each cube of a level
};

}  // namespace hermesh
