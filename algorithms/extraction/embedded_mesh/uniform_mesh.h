// The finest mesh of `manifold-dual-contouring`: closed, oriented, manifold and free of self-intersection, by
// construction and, where that asks too much, by tests.
//
// **Why no two polygons meet** (index space; corners are lattice points). Give every cell a point strictly
// inside it, and cut space into the tetrahedra of every lattice edge with the points of each two cells that
// share a face at that edge. These fill space without overlap: a face is cut by the segment between its two
// cells' points into four triangles, and the point of a cell sees the cell's boundary once. The same holds
// after points have moved as long as every tetrahedron stays positively oriented (a piecewise linear map that
// is the identity far away and turns no tetrahedron over is a homeomorphism), so a point may leave its cell
// for a sharp feature if its 24 tetrahedra allow it. The four tetrahedra of a crossing edge are its
// *envelope*; two envelopes meet at most in the segments between points and in lattice corners.
//
//   plain edge     a quad of the four points; each of its two triangles lies in the envelope, which is
//   checked
//                  (Ju & Udeshi 2006, envelopes on an octree). One diagonal or the other nearly always does.
//   fanned edge    else four triangles from the crossing itself, which is a point of the mesh then: each of
//   them lies in
//                  one tetrahedron.
//   explicit face  where a cell has several sheets, or a face is ambiguous, the surface can be held to the
//   straight segments
//                  between the crossings on the faces (cell_sheets.h). Each sheet is a cone over its loop of
//                  segments, from a point of the hull of the loop's crossings if there are several sheets:
//                  hulls of two loops never meet, and a cone over a simple loop on a convex cell's boundary,
//                  from a point inside, is embedded. This is the last resort where polygons of such cells
//                  without it meet others (sheet_trials.h), and is counted. How an ambiguous face is cut the
//                  normals tell (CellBlocks::sheets()).
//
// **Rounding.** The file's precision moves a point by up to an eighth of the margin that crossings keep off
// the ends of their edges, and points of cells off their faces (CellBlocks::rounding(), margin()). So these
// points stay in their cells, but crossings leave their edges, and beside a lattice corner tetrahedra may be
// as thin as the square of the margin. Therefore the last two arguments have conditions:
//
//   fanned edge    The point x of an edge ab must cut each tetrahedron abpq of the envelope into two that are
//   positively
//                  oriented, axpq and xbpq; then the argument about moved points holds for x, too. If the
//                  rounded crossing does not, x moves towards the middle of the edge in the smallest step
//                  that suffices (fan_point() in sheet_trials.cpp). The middle always suffices: across the
//                  edge, let p be at (p₁, p₂) and q at (−q₁, q₂), all four at least 7/8 of the margin. Before
//                  rounding, six times the volume of either part is (p₁q₂ + p₂q₁)/2 ≥ 7/16 margin · s, where
//                  s = max(p₁ + q₁, p₂ + q₂). An eighth of the margin off the edge along both axes, x changes
//                  it by 1/4 margin · s at most. In mean placement a point may be at 5/24 of the margin;
//                  there rounding must be below a nineteenth of the margin, which is not checked. A point
//                  leaves its cell only if enough room remains. The step is at most twice as long as
//                  necessary, or 1/2048 voxel; therefore x is in the hull of the crossing and the four
//                  points, or as near to it as that. Fans around cells of several sheets or with ambiguous
//                  faces are tested instead.
//   explicit face  The polygons of held cells are tested, too. A held cell whose polygons still meet others
//   is
//                  *centred*: its crossings move to the middles of their edges, and the points of all sheets
//                  there to the means of their crossings. Then the segments cut its faces into triangles of
//                  at least 1/8 square voxel, which make positively oriented tetrahedra with a point at least
//                  7/8 of the margin off the face on either side: rounding changes six times their volume by
//                  4/7 of it at most. The hulls of two loops are half a voxel apart.
//
// Points that the tetrahedra keep within their cells, and would rather be elsewhere, are moved after that,
// one by one and only where the mesh as it is then shows that nothing meets (late_moves.h).
//
// None of this asks what lies on the two sides of a crossing edge, so it holds, too, for a lattice whose
// inside is divided among pieces (cell_blocks.h): the polygons of all pieces together, each seam between two
// pieces once, meet at most in shared edges and points. A joint is never held itself; a face between a joint
// and a cell that can be is without a cut, and the joint's part of the surface beside a segment on it is the
// triangle of it and the joint's point, within the joint's tetrahedra at that face if it has one point. The
// polygons of joints of several sheets are tested, and what meets others even when all else is held is named,
// so that the lattice can be made anew with one sheet there.
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
#include "algorithms/extraction/embedded_mesh/uniform_points.h"
#include "algorithms/hermite/hermite_view.h"

namespace hermesh {

/// What was met on the way to a uniform mesh.
struct UniformCounts {
  std::uint64_t cells = 0;           ///< cells that the surface passes through
  std::uint64_t joints = 0;          ///< cells with a cut (cell_blocks.h)
  std::uint64_t several_sheets = 0;  ///< cells with several sheets
  std::uint64_t held = 0;            ///< cells coned over explicit segments, the last resort
  std::uint64_t fanned_edges = 0;    ///< crossing edges that became four triangles or more
  std::uint64_t escaped = 0;         ///< points outside their cells
  /// Joints of several sheets, by block and cell, whose polygons may meet others: that no two polygons meet
  /// is promised only if there are none.
  std::vector<std::pair<std::int32_t, int>> meeting_joints;
};

/// The finest mesh. Polygons are counter-clockwise seen from outside, in index space.
struct UniformMesh {
  std::vector<Eigen::Vector3d>
      points;              ///< index space relative to the placement's base; FilePoints::rounded()
  LargeArray<Quad> quads;  ///< abc and acd are the triangles of a quad abcd
  std::vector<Triangle> triangles;
  UniformCounts counts;
};

/// The uniform mesh of Hermite data: one point for each sheet of a cell. Creases and corners are kept as far
/// as the QEF sees them and a point may leave its cell: by kFarthestFromCell at most, whatever the options'
/// reach. The same bytes for every number of threads.
/// @throws Error if there are more points or polygons than 32 bits can number, or if a file cannot hold the
/// points
///   (CellBlocks); Cancelled
UniformMesh uniform_mesh(const HermiteView& grid, const DualContouringOptions& options,
                         const FilePoints& file, RunContext& context);

/// The uniform mesh of points that keep to their cells (`reach` is 0), made only where it is asked for.
class UniformCells {
 public:
  UniformCells(const HermiteView& grid, const DualContouringOptions& options, const FilePoints& file,
               RunContext& context);
  ~UniformCells();

  const CellBlocks& cells() const;
  /// The points that were asked for. References to single ones last until more are asked for.
  const UniformPoints& points() const;
  /// Counts of what was made so far.
  const UniformCounts& counts() const;
  /// Places the points of the active cells in `wanted`, a mask per block, that are not there yet. @throws
  /// Cancelled
  void place(std::span<const BlockMask> wanted, RunContext& context);
  /// Places the points of all cells, which takes less time than if they were asked for one by one. Nothing
  /// may have been placed before. @throws Cancelled
  void place_all(RunContext& context);
  /// Makes the polygons of crossing edges all of whose cells have their points, and the points on the edges
  /// that are fanned.
  /// @param edges which; all if null. All edges of cells that have several sheets or an ambiguous face must
  /// be among
  ///   them, and those within two cells of one: else nothing is promised. They must outlive the result.
  /// @param context told of progress, and asked whether to stop
  /// @throws Error if there are more points or polygons than 32 bits can number; Cancelled
  EdgePolygons connect(const EdgeMasks* edges, RunContext& context);

 private:
  struct Made;
  std::unique_ptr<Made> made_;
};

/// The edge that each polygon belongs to, by its number among the crossing edges: ascending by block, axis
/// and sample.
struct PolygonEdges {
  std::vector<std::uint32_t> quads, triangles;
};

/// The uniform mesh of a lattice that may have cuts. A polygon at a cut is counter-clockwise seen from the
/// edge's second sample. `edges`, where it is not null, is told of the edge that each polygon belongs to.
/// Throws as the function for Hermite data does.
UniformMesh uniform_mesh(const CellGrid& grid, const DualContouringOptions& options, const FilePoints& file,
                         RunContext& context, PolygonEdges* edges = nullptr);

}  // namespace hermesh
