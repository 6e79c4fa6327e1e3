// Uniform dual contouring of Hermite data (Ju et al. 2002; Aldén 2011, chapter 6 without merging).
#pragma once

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/variant.h"
#include "algorithms/hermite/hermite_view.h"

namespace hermesh {

struct DualContouringOptions {
  enum class Placement {
    unbiased,  ///< minimiser of the QEF, corrected for its bias on smooth surfaces (qef.h)
    optimal,   ///< minimiser of the QEF: preserves sharp features
    average    ///< mean of the cell's crossings: smooth, and needs no normals
  };
  Placement placement = Placement::unbiased;
  /// Edge crossings are interpolated linearly from a level set, which has a curvature bias of its own.
  bool linear_crossings = false;
  /// Singular values below this share of the largest are dropped; larger is smoother with fewer features.
  double truncation = 0.1;
  /// Largest distance of a vertex from its cell, in voxels, if a feature passes outside: only where no
  /// position in the cell is near the planes. Larger preserves more of features; 0 keeps every vertex in its
  /// cell.
  double reach = 1.0;
  /// ExtractionInput::caps, for certified extractors.
  Bounds caps = Bounds::unbounded();

  bool needs_normals() const { return placement != Placement::average; }
  /// Returns the share of the path from the mass point to the minimiser on smooth surfaces (qef.h).
  double smooth_share() const;
};

/// Returns one vertex for each active cell and one quad for each crossing edge. Closed and oriented; not
/// manifold where several sheets pass through one cell, because they share its vertex. A quad is split along
/// the diagonal whose surface is nearer to the edge crossing, so a crease is not cut across.
PolygonMesh dual_contouring(const HermiteView& grid, const DualContouringOptions& options,
                            RunContext& context);

/// Returns the same polygons as for the data of sample_level_set(), in another order: a leaf at a time, in
/// the order of the tree, without Hermite data in between. Vertices agree to a few thousandths of a voxel,
/// because they are computed in single precision; of two diagonals that are equally good to rounding, the
/// other one may be chosen. The bytes are the same for any number of threads and every SIMD instruction set.
/// @throws Error for an isovalue or a sample that is not finite, for a grid with perspective, and for more
/// vertices or quads than 32 bits can index; Cancelled.
PolygonMesh contour_level_set(const LevelSet& level_set, double isovalue,
                              const DualContouringOptions& options, RunContext& context);
/// Returns false for a truncation too small for single precision.
bool can_contour_level_set(const DualContouringOptions& options);

class Qef;  // qef.h

/// Returns the position of the vertex of the cell with its first corner at `corner`, in the frame of `qef`
/// (voxels), by placement=unbiased or optimal: within the cell or up to `reach` outside.
Eigen::Vector3d place_by_planes(const Qef& qef, const Eigen::Vector3d& corner,
                                const DualContouringOptions& options);

/// Reads options that were checked against dual_contouring_options(), and the source of hermite_input().
DualContouringOptions read_dual_contouring_options(const ExtractionInput& input);
/// Reads the same without `reach`, for an extractor whose table has none.
DualContouringOptions read_placement_options(const ExtractionInput& input);

/// Implements the table's entry: samples the Hermite data first. @throws Error as hermite_input() does;
/// Cancelled.
PolygonMesh dual_contouring(const ExtractionInput& input);
std::vector<OptionSpec> dual_contouring_options();

}  // namespace hermesh
