// Samplers: where Hermite data comes from (Aldén 2011, §2.8 and §5.2).
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

/// Hermite data from samples of a scalar field: crossings by linear interpolation along the edge, normals
/// from the interpolated gradient (central differences of active samples, one-sided at the end of the data;
/// the background is never read unless an end of the edge itself lies in it). In a level set samples less
/// than the isovalue are inside; in any other volume those on the other side of it than the background.
/// @throws Error for an isovalue or sample that is not finite, and for a grid with perspective.
FloatHermite sample_level_set(const LevelSet& level_set, double isovalue, RunContext& context);

/// Hermite data as sample_level_set() makes it, packed as it is computed. @throws Error and Cancelled as
/// sample_level_set() does.
PackedHermite sample_level_set_packed(const LevelSet& level_set, double isovalue, NormalCodeId code,
                                      RunContext& context);

/// What became of the crossing edges of sample_polygons().
struct PolygonSampling {
  std::size_t exact = 0;    ///< edges that got the hit with a polygon
  std::size_t nearest = 0;  ///< edges that no polygon hits, for a sample's sign is not the polygons'; they
                            ///< got the nearest one's plane
  std::size_t fallback =
      0;  ///< edges without a polygon within a voxel that faces the right way; from the level set
  std::size_t ambiguous = 0;  ///< edges among the exact ones with several hits, of which one was chosen
};

/// Hermite data from polygons: where a crossing edge of the level set hits a polygon, the exact hit and the
/// polygon's normal, turned towards the outside. Where none does, the plane of the polygon nearest to the
/// level set's crossing. Of several hits the one taken passes from inside to outside as the signs of the
/// edge's ends say and lies nearest to the level set's own crossing; equal ones go to the lowest triangle
/// number. So the result does not depend on the order of the work.
FloatHermite sample_polygons(const LevelSet& level_set, double isovalue, const PolygonMesh& mesh,
                             RunContext& context, PolygonSampling* sampling = nullptr);

/// A surface given by a function: negative inside.
struct AnalyticSurface {
  std::function<double(const Eigen::Vector3d&)> value;
  /// Gradient of `value`, of any length; where it vanishes the edge's direction is taken.
  std::function<Eigen::Vector3d(const Eigen::Vector3d&)> gradient;
  /// Bound of the slope of `value`, so that blocks far from the surface can be skipped; 1 for a distance.
  double lipschitz = 1.0;
};

/// Hermite data of a function on the samples `lower` to `upper` (index coordinates, inclusive) of the lattice
/// at `placement`; all beyond is outside, and the function must be positive on the border of that box. A
/// crossing is found to within `tolerance` of the length of its edge by bracketing, whatever the shape of the
/// function. @throws Error for a box or a function for which this does not hold.
FloatHermite sample_function(const AnalyticSurface& surface, const IndexToWorld& placement,
                             const std::array<std::int32_t, 3>& lower,
                             const std::array<std::int32_t, 3>& upper, double tolerance, RunContext& context);

}  // namespace hermesh
