// The uniform mesh of `manifold-dual-contouring`: closed, oriented, manifold and free of self-intersection,
// by construction and, where the construction does not suffice, by tests.
//
// **No two polygons intersect** (index space; corners are lattice points). Place a vertex strictly inside
// every cell, and divide space into the tetrahedra of every lattice edge and the vertices of every two cells
// that share a face at that edge. They fill space without overlap: the segment between the vertices of two
// cells intersects their common face and divides it into four triangles, and each ray from a cell's vertex
// intersects the cell's boundary once. The same holds after vertices have moved, as long as every tetrahedron
// remains positively oriented (a piecewise linear map that is the identity far away and inverts no
// tetrahedron is a homeomorphism). So a vertex may leave its cell for a sharp feature if its 24 tetrahedra
// allow it. The four tetrahedra of a crossed edge are its *envelope*; two envelopes meet at most in segments
// between vertices and in lattice corners.
//
//   plain edge     A quad of the four vertices, both of whose triangles lie in the envelope. This is tested
//   (Ju &
//                  Udeshi 2006, envelopes on an octree); one of the two diagonals nearly always suffices.
//   fanned edge    Otherwise four triangles around the crossing, which becomes a vertex; each lies in one
//                  tetrahedron.
//   explicit face  In a cell with several sheets, or at an ambiguous face, the surface can be held to the
//   straight
//                  segments between the crossings on the faces (cell_sheets.h). Each sheet is then a cone
//                  over its loop of segments. If there are several, the apex is in the hull of the loop's
//                  crossings: the hulls of two loops are disjoint, and a cone from a point inside a convex
//                  cell over a simple loop on its boundary is embedded. This is the last resort if the
//                  unconstrained polygons of such cells intersect others (tested_polygons.h), and is counted.
//                  Normals decide how an ambiguous face is drawn (CellBlocks::sheets()).
//
// **Rounding.** The file's precision moves a point by up to 1/8 of the margin between crossings and the ends
// of their edges, and between vertices and the faces of their cells (CellBlocks::rounding(), margin()). So
// vertices remain in their cells, but crossings leave their edges, and near a lattice corner tetrahedra may
// be as thin as the square of the margin. The last two cases therefore have conditions:
//
//   fanned edge    The vertex x of an edge ab must divide each tetrahedron abpq of the envelope into two
//   positively
//                  oriented ones, axpq and xbpq; then the argument for moved vertices covers x. If the
//                  rounded crossing does not, x moves towards the middle of the edge by the least step that
//                  suffices (fan_point() in tested_polygons.cpp). The middle always suffices: across the
//                  edge, let p be at (p₁, p₂) and q at (−q₁, q₂), all four at least 7/8 of the margin. Before
//                  rounding, six times the volume of either part is (p₁q₂ + p₂q₁)/2 ≥ 7/16 margin · s, where
//                  s = max(p₁ + q₁, p₂ + q₂). With x at 1/8 of the margin off the edge along both axes, it
//                  changes by 1/4 margin · s at most. In mean placement a vertex may be at 5/24 of the
//                  margin; rounding must then be below 1/19 of the margin, which is not checked. A vertex
//                  leaves its cell only if enough room remains. The step is at most twice the necessary one,
//                  or 1/2048 voxel; so x is that near to the hull of the crossing and the four vertices. Fans
//                  at cells of several sheets or with ambiguous faces are tested instead.
//   explicit face  The polygons of held cells are tested, too. A held cell whose polygons still intersect
//   others is
//                  *centred*: its crossings move to the middles of their edges, and the vertices of all
//                  sheets there to the means of their crossings. The segments then divide its faces into
//                  triangles of at least 1/8 square voxel, which form positively oriented tetrahedra with a
//                  point at least 7/8 of the margin off the face on either side: rounding changes six times
//                  their volume by at most 4/7 of it. The hulls of two loops are half a voxel apart.
//
// **Vertices on the faces of their cells**, as those of a polyhedron with faces in planes of the lattice,
// have targets nearer to these than the margin. They are placed at the margin first, and reach their targets
// by the rule for vertices that leave their cells. Its tetrahedra would have no volume with corners at
// lattice points, so the corners are moved a little (tetrahedron_corners.h).
//
// Vertices that the tetrahedra confine to their cells, but whose targets are outside, are moved afterwards,
// one by one, if a test of the current mesh finds no intersection (late_moves.h).
//
// The argument does not depend on what lies on the two sides of a crossed edge, so it also holds for a
// lattice whose inside is divided into pieces (cell_blocks.h): the polygons of all pieces together, with each
// seam between two pieces once, meet at most in shared edges and vertices. A joint is never held. A face
// between a joint and a cell that can be held has no cut, and the joint's part of the surface at a segment on
// it is the triangle of the segment and the joint's vertex, which lies within the joint's tetrahedra at that
// face if it has one vertex. The polygons of joints of several sheets are tested; those that intersect others
// even if all else is held are reported, so that the lattice can be rebuilt with one sheet there.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/extraction/dual_contouring/dual_contouring.h"
#include "algorithms/extraction/embedded_mesh/cell_blocks.h"
#include "algorithms/extraction/embedded_mesh/edge_polygons.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"
#include "algorithms/extraction/embedded_mesh/point_target.h"
#include "algorithms/extraction/embedded_mesh/uniform_points.h"
#include "algorithms/extraction/embedded_mesh/uniform_tiling.h"
#include "algorithms/hermite/hermite_view.h"

namespace hermesh {

/// Statistics of a uniform mesh.
struct UniformCounts {
  std::uint64_t cells = 0;           ///< active cells
  std::uint64_t joints = 0;          ///< cells with a cut (cell_blocks.h)
  std::uint64_t several_sheets = 0;  ///< cells with several sheets
  std::uint64_t held = 0;            ///< cells held to explicit segments, the last resort
  std::uint64_t fanned_edges = 0;    ///< crossed edges with a vertex
  std::uint64_t escaped = 0;         ///< vertices outside their cells
  /// Joints of several sheets whose polygons may intersect others, by block and cell. The mesh is guaranteed
  /// to be free of self-intersection only if there are none.
  std::vector<std::pair<std::int32_t, int>> meeting_joints;
};

/// The uniform mesh. Polygons are counter-clockwise seen from outside, in index space.
struct UniformMesh {
  std::vector<Eigen::Vector3d> points;  ///< relative to the placement's base; FilePoints::rounded()
  LargeArray<Quad> quads;               ///< abc and acd are the triangles of a quad abcd
  std::vector<Triangle> triangles;
  std::vector<MissedTarget> missed;  ///< ascending by point
  UniformCounts counts;
};

/// Returns the uniform mesh of Hermite data: one vertex for each sheet of a cell. Creases and corners are
/// reproduced as far as the QEF detects them and a vertex may leave its cell: by at most kFarthestFromCell,
/// whatever the options' reach. The result does not depend on the number of threads.
/// @throws Error for more than 2³² vertices or polygons, or if a file cannot represent the vertices
/// (CellBlocks);
///   Cancelled
UniformMesh uniform_mesh(const HermiteView& grid, const DualContouringOptions& options,
                         const FilePoints& file, RunContext& context, const UniformTiling& tiling = {});

/// The uniform mesh with vertices confined to their cells (`reach` is 0), computed only where requested.
class UniformCells {
 public:
  UniformCells(const HermiteView& grid, const DualContouringOptions& options, const FilePoints& file,
               RunContext& context);
  ~UniformCells();

  const CellBlocks& cells() const;
  /// Returns the vertices placed so far. References to single ones are invalidated by the next request.
  const UniformPoints& points() const;
  const UniformCounts& counts() const;  ///< of the parts made so far
  /// Computes the vertices of the active cells in `wanted`, a mask per block, unless done before. @throws
  /// Cancelled
  void place(std::span<const BlockMask> wanted, RunContext& context);
  /// Computes the vertices of all cells, faster than one by one. None may have been computed before. @throws
  /// Cancelled
  void place_all(RunContext& context);
  /// Makes the polygons of crossed edges all of whose cells have their vertices, and the vertices of fanned
  /// edges.
  /// @param edges the edges, all if null; must outlive the result. They must contain all edges of cells that
  /// have
  ///   several sheets or an ambiguous face, and of cells within two cells of one: otherwise nothing is
  ///   guaranteed.
  /// @param context receives the progress and the request to cancel
  /// @throws Error for more than 2³² vertices or polygons; Cancelled
  EdgePolygons connect(const EdgeMasks* edges, RunContext& context);

 private:
  struct Made;
  std::unique_ptr<Made> made_;
};

/// The edge of each polygon, by its number among the crossed edges: ascending by block, axis and sample.
struct PolygonEdges {
  std::vector<std::uint32_t> quads, triangles;
};

/// Returns the uniform mesh of a lattice that may have cuts. A polygon at a cut is counter-clockwise seen
/// from the edge's second sample. `edges`, if not null, receives the edge of each polygon. Throws as the
/// overload above.
UniformMesh uniform_mesh(const CellGrid& grid, const DualContouringOptions& options, const FilePoints& file,
                         RunContext& context, PolygonEdges* edges = nullptr);

}  // namespace hermesh
