// The joint mesh of all pieces at the finest level: every seam once, with the pieces on its two sides.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/extraction/embedded_mesh/uniform_mesh.h"
#include "algorithms/fracture/labelled_grid.h"

namespace hermesh {

/// The mesh of all pieces together: one vertex for each sheet of a cell, and triangles for each crossing
/// edge.
///
/// **Guarantees**, if every cell of the grid is simple (label_repair.h) and `meeting_joints` is empty: the
/// triangles with a piece on one side, oriented so that the piece is behind them, are a closed oriented
/// manifold; the triangles of all pieces intersect only in the edges and vertices that they share
/// (uniform_mesh.h). So each piece is free of self-intersections, no two pieces overlap, and the interface
/// between two pieces consists of the same triangles in both. All of this holds for the coordinates as
/// written to a file.
struct JointMesh {
  IndexToWorld placement;
  std::vector<Eigen::Vector3d>
      points;  ///< index coordinates relative to the placement's base, as FilePoints::rounded() gives them
  /// Corners are counter-clockwise in index space, seen from the triangle's side `front`.
  std::vector<Triangle> triangles;
  std::vector<EdgeSides> sides;  ///< pieces and cutter of each triangle

  std::uint64_t joints = 0;                          ///< cells where pieces meet
  std::uint64_t several_sheets = 0;                  ///< cells with several sheets
  std::uint64_t fanned_edges = 0, escaped = 0;       ///< as in UniformCounts
  std::vector<LabelledSolid::Place> meeting_joints;  ///< as in UniformCounts
};

/// Makes the mesh of all pieces. The position of a joint's vertex depends on all crossings of the joint, so
/// that the boundary of a cut is a sharp crease even where the original surface is smooth. The result has the
/// same bytes at any thread count. `from_voxels`, if given, confines the vertices to their cells and bounds
/// their distance from the boundary between voxels (extraction/embedded_mesh/near_voxels.h).
/// @throws Cancelled.
JointMesh joint_mesh(const LabelledGrid& grid, const DualContouringOptions& options, RunContext& context,
                     std::optional<double> from_voxels = std::nullopt);

/// Which triangles of a joint mesh bound each piece.
class PieceTriangles {
 public:
  /// A triangle of the joint mesh, oriented as in one of its pieces.
  struct Side {
    std::uint32_t triangle;
    bool reversed;  ///< the piece is in front of the triangle
  };
  /// Sorts the triangles of the mesh, whose sides name no piece above `pieces`.
  PieceTriangles(const JointMesh& mesh, std::uint32_t pieces);

  /// Returns the number of pieces.
  std::uint32_t count() const { return static_cast<std::uint32_t>(first_.size()) - 2; }
  /// Returns the triangles that bound a piece from 1 to count(), in the order of the joint mesh.
  std::span<const Side> of(std::uint32_t piece) const {
    return std::span(sides_).subspan(first_[piece], first_[piece + 1] - first_[piece]);
  }

 private:
  std::vector<std::size_t> first_;
  std::vector<Side> sides_;
};

/// Returns a piece as a separate mesh. Vertices have the same order as in the joint mesh; all pieces have the
/// placement's origin, so that files preserve the seams exactly. The polygons have the attributes `surface`
/// (0 original, 1 cut), `cutter` (−1 for the original surface, and for a cut that belongs to no cutter) and
/// `neighbour` (the piece on the other side, −1 for the outside).
PolygonMesh piece_mesh(const JointMesh& mesh, std::span<const PieceTriangles::Side> triangles);

}  // namespace hermesh
