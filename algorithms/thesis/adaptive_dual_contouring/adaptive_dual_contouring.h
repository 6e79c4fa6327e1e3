// Adaptive dual contouring as printed (Aldén 2011, chapter 6): cells merged into regions of 2³, 4³ and 8³
// within each block, in parallel and without an octree. Nothing is repaired.
//
// Faithful, by section:
//   6.1  the Hermite data are the 10 bytes of §4.2 unless an option selects others, and are meshed as they
//        are packed: where they lose a crossing (trap T2) there is a hole. `lost_crossings = repaired`
//        replaces it by the middle of the edge, and other representations lose none; then the mesh is
//        closed and oriented.
//   6.2  the QEF sums squared distances to the tangent planes of all crossings; its minimiser comes from a
//        truncated singular value decomposition and is not constrained to its region (trap T7; counted
//        by the statistics `escaped…`).
//   6.3  both topology tests, the first by a table. They gate only merging: a cell with several sheets still
//        has one point, so edges and points may be non-manifold even at threshold 0 (trap T5). Each can be
//        switched off, to see its effect.
//   6.4  steps 1 to 4: active are the cells around edges tagged with data; level by level, a region is tried
//        only if all its active cells are mergeable, and its cells are no longer mergeable once it fails;
//        every block separately; a mask grid of integers, which finally hold the number of the cell's point:
//        16 bits that count within the block, where the thesis has 32. (During the work on a block its levels
//        and flags are one bit per region.)
//   6.5  for every crossing edge the four cells around it give a quad, a triangle if they have three points,
//        and nothing if they have fewer. The sign at the edge's first sample orients it.
//
// Readings of gaps in the text (paper/readings.md, R20 to R32, lists the effect of each):
//   - A region's QEF is the sum of those of its cells, so a crossing counts once for each of its cells in the
//     region: four times in the interior ("using the Hermite data of the corresponding cells"; Ju et al. add
//     up the same way).
//   - E is compared as "less than the threshold", at the potential point. So threshold 0 merges nothing.
//   - A region with no active cell in some child needs nothing of that child. One active cell may be a
//     region.
//   - A singular value is "minimal" below `truncation` times the largest. The singular values of A are the
//     roots of the eigenvalues of AᵀA, which are found in single precision by Jacobi's rotations: the text
//     decomposes A itself.
//   - If singular values are dropped the minimisers are a line or a plane. The one nearest to the mass point
//     is taken (Ju et al. 2002). The text's bare pseudo-inverse takes the one nearest to the origin of an
//     unspecified frame: `Nearest::corner` has it, with the first sample of the cell or region as origin.
//   - If a region fails, its cells keep the regions that they have, and no larger one around them is tried.
//   - A quad begins with the cell one step down both other axes from the edge's first sample, and is split
//     from there.
//
// The unit of the threshold (trap T6) is not in the text, and E grows with the number of cells. Here lengths
// are voxels and normals have unit length, so E is in square voxels. The thesis's 0 to 2000 cannot be that: a
// region has about 300 planes, so 2000 would let every one be two voxels off. Its reductions are met if 1000
// of its units, within a quarter, are one square voxel, with Hermite data quantised as there
// (experiments/questions/thesis/table_9_2.toml).
//
// Cost: without the Hermite data three quarters of the time are merging, about evenly the sums of the QEFs,
// their minimisers, and waiting for crossings and fresh pages; connecting takes a sixth.
#pragma once

#include <array>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/variant.h"
#include "algorithms/extraction/adaptivity_field.h"
#include "algorithms/thesis/voxels/dense_hermite.h"

namespace hermesh {

/// Options of merging and of the placement of points.
struct AdaptiveOptions {
  /// Position of the point of a cell or region.
  enum class Placement {
    optimal,  ///< minimiser of the QEF
    average   ///< mean of the crossings, each as often as it counts in the QEF
  };
  /// Choice among the minimisers if singular values are dropped.
  enum class Nearest {
    mass_point,  ///< to the mean of the crossings
    corner       ///< to the first sample of the cell or region: only the pseudo-inverse of §6.2.1
  };
  /// Topology tests of §6.3 that a region must pass to be merged.
  enum class TopologyTests {
    both,
    table,  ///< only the first: the corners' signs collapse to one edge
    signs,  ///< only the second: middles agree with corners
    none
  };
  Placement placement = Placement::optimal;
  /// Bound of E in square voxels: a region is merged if its E is less. Larger merges more; 0 nothing.
  double threshold = 0.1;
  /// Share of the largest singular value below which others are dropped; larger is smoother. At 0 none is, as
  /// if eq. 6.4 were solved as printed: except directions in which E does not change in double precision
  /// (kLeastTruncation in qef_sum.h).
  double truncation = 0.1;
  Nearest nearest = Nearest::mass_point;
  TopologyTests topology_tests = TopologyTests::both;
};

/// Upper ends, in voxels, of the ranges of the statistics `escaped_to_…`, which count points by their
/// distance outside: each range begins where the previous one ends, the first above 0.
inline constexpr std::array<float, 6> kEscapeRanges{0.01f, 0.1f, 0.5f, 1.0f, 2.0f, 4.0f};

/// Meshes Hermite data adaptively. The mesh is closed and oriented, in the sense that as many polygons pass
/// along an edge in one direction as in the other, except where `field` leaves polygons out; it is not
/// manifold. `field` may be null. The bytes are the same at any number of threads.
///
/// Figures of the run:
///   - `regions_1`, `regions_2` and `regions_3`: regions of 2³, 4³, 8³ cells;
///   - `largest_plane_distance`: voxels, from the point of a merged region to a plane of it;
///   - `escaped`: points outside their cell or region (trap T7); `largest_escape`: the largest distance, in
///     voxels, along the axis on which it is greatest; `escaped_to_0.01`, …, `escaped_to_4`,
///     `escaped_beyond_4`: their numbers by distance (kEscapeRanges);
///   - `quads_step_0`, …, `quads_step_3` and `triangles_step_0`, …: polygons by the difference of level
///     between the coarsest and the finest region around their edge (§6.5, fig. 6.4); a lone cell has level
///     0.
/// @throws Error for a mesh of more than 2³² points or polygons, and as FieldEvaluator does; Cancelled.
PolygonMesh adaptive_dual_contouring(const FloatHermite& hermite, const AdaptiveOptions& options,
                                     const AdaptivityField* field, RunContext& context);

/// Meshes the thesis's packed 10-byte voxels directly (§6.1), by the edges that have data according to their
/// voxel. So the mesh has holes where a crossing is lost (trap T2), and polygons inside or outside of the
/// solid where eq. 7.1 left data between samples of one sign (trap T11): it is neither closed nor oriented.
/// Otherwise as above. Further statistics are `lost_crossings` and `needless_crossings`, in this order; a
/// note reports losses.
PolygonMesh adaptive_dual_contouring(const ThesisDense& hermite, const AdaptiveOptions& options,
                                     const AdaptivityField* field, RunContext& context);

/// Implements the variant: meshes a level set via Hermite data, with the input's options.
PolygonMesh adaptive_dual_contouring(const ExtractionInput& input);
/// Options of the variant: those of AdaptiveOptions, and those of the Hermite data.
std::vector<OptionSpec> adaptive_dual_contouring_options();

}  // namespace hermesh
