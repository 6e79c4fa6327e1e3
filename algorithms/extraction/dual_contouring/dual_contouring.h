// Uniform dual contouring of Hermite data (Ju et al. 2002; Aldén 2011, chapter 6 without merging).
#pragma once

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/variant.h"
#include "algorithms/hermite/hermite_view.h"

namespace hermesh {

struct DualContouringOptions {
  enum class Placement {
    unbiased,  ///< minimiser of the QEF, drawn back on smooth surfaces by what it lies outside of them
               ///< (qef.h)
    optimal,   ///< minimiser of the QEF: keeps sharp features
    average    ///< mean of the cell's crossings: smooth, and needs no normals
  };
  Placement placement = Placement::unbiased;
  /// Crossings were found by linear interpolation of a level set, which has a curvature bias of its own.
  bool linear_crossings = false;
  /// Singular values below this share of the largest are dropped; larger is smoother and keeps fewer
  /// features.
  double truncation = 0.1;
  /// How far a point may leave its cell, in voxels, to meet a feature that passes outside: only where no
  /// place within the cell comes near the planes. Larger keeps more of features; 0 holds every point in its
  /// cell.
  double reach = 1.0;
  /// ExtractionInput::caps, for certified extractors.
  Bounds caps = Bounds::unbounded();

  bool needs_normals() const { return placement != Placement::average; }
  /// How far points go from the mass point to the minimiser on smooth surfaces (qef.h).
  double smooth_share() const;
};

/// One point for each active cell and one quad for each crossing edge. Closed and oriented; not manifold
/// where several sheets pass through one cell, for they share its point. A quad's split runs along the
/// diagonal whose two triangles turn less against each other, so that a crease is not cut across.
PolygonMesh dual_contouring(const HermiteView& grid, const DualContouringOptions& options,
                            RunContext& context);

class Qef;  // qef.h

/// The place of the point of the cell with its first corner at `corner`, in the frame of `qef` (voxels), by
/// placement=unbiased or optimal: within the cell or up to `reach` outside.
Eigen::Vector3d place_by_planes(const Qef& qef, const Eigen::Vector3d& corner,
                                const DualContouringOptions& options);

/// Reads options that were checked against dual_contouring_options(), and where the crossings of
/// hermite_input() are from.
DualContouringOptions read_dual_contouring_options(const ExtractionInput& input);
/// Reads the same without `reach`, for an extractor whose table has none.
DualContouringOptions read_placement_options(const ExtractionInput& input);

/// Dual contouring as the table of variants calls it: samples the Hermite data first, from the level set or,
/// where asked, from the source polygons. @throws Error as hermite_input() does; Cancelled.
PolygonMesh dual_contouring(const ExtractionInput& input);
std::vector<OptionSpec> dual_contouring_options();

}  // namespace hermesh
