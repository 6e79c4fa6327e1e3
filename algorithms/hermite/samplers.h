// Samplers, the sources of Hermite data (Aldén 2011, §2.8 and §5.2).
#pragma once

#include <array>
#include <cstdint>
#include <functional>

#include "algorithms/core/level_set.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/hermite/sparse_hermite.h"
#include "algorithms/lattice/placement.h"

namespace hermesh {

/// Samples a scalar field: crossings by linear interpolation along the edge, normals from the interpolated
/// gradient (central differences of active samples, one-sided at the end of the data; the background is only
/// read if an end of the edge lies in it). In a level set samples less than the isovalue are inside; in any
/// other volume those on the other side of it than the background.
/// @throws Error for an isovalue or sample that is not finite, and for a grid with perspective.
FloatHermite sample_level_set(const LevelSet& level_set, double isovalue, RunContext& context);

/// Computes the data of sample_level_set() in packed form. @throws Error and Cancelled as sample_level_set().
PackedHermite sample_level_set_packed(const LevelSet& level_set, double isovalue, NormalCodeId code,
                                      RunContext& context);

/// Statistics of sample_polygons() about crossing edges.
struct PolygonSampling {
  std::size_t exact = 0;  ///< edges with the hit of a polygon
  std::size_t nearest =
      0;  ///< edges without a hit, as a sample has a different sign; with the nearest polygon's plane
  std::size_t fallback =
      0;  ///< edges without a polygon of the right orientation within a voxel; from the level set
  std::size_t ambiguous = 0;  ///< exact edges with several hits, of which one was chosen
};

/// Samples polygons: where a crossing edge of the level set hits a polygon, the exact hit and the polygon's
/// normal, turned towards the outside. Without a hit, the plane of the polygon nearest to the level set's
/// crossing. Of several hits the one is taken that passes from inside to outside according to the signs of
/// the edge's ends and lies nearest to the level set's own crossing; of equal ones the lowest triangle
/// number. So the result does not depend on the order of the work.
FloatHermite sample_polygons(const LevelSet& level_set, double isovalue, const PolygonMesh& mesh,
                             RunContext& context, PolygonSampling* sampling = nullptr);

/// A surface given by a function: negative inside.
struct AnalyticSurface {
  std::function<double(const Eigen::Vector3d&)> value;
  /// Gradient of `value`, of any length; if it vanishes the edge's direction is used.
  std::function<Eigen::Vector3d(const Eigen::Vector3d&)> gradient;
  /// Bound of the slope of `value`, so that blocks far from the surface can be skipped; 1 for a distance.
  double lipschitz = 1.0;
};

/// Samples a function on the samples `lower` to `upper` (index coordinates, inclusive) of the lattice at
/// `placement`; all beyond is outside, and the function must be positive on the border of that box. A
/// crossing is found to within `tolerance` of the length of its edge by bracketing, for any function.
/// @throws Error for a box or a function for which this does not hold.
FloatHermite sample_function(const AnalyticSurface& surface, const IndexToWorld& placement,
                             const std::array<std::int32_t, 3>& lower,
                             const std::array<std::int32_t, 3>& upper, double tolerance, RunContext& context);

}  // namespace hermesh
