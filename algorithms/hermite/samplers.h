// Samplers: where Hermite data comes from (Aldén 2011, §2.8 and §5.2).
#pragma once

#include "algorithms/core/blocks.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/hermite/hermite_grid.h"

namespace hermesh {

/// From samples of a scalar field: crossings by linear interpolation along the edge, normals from the
/// interpolated gradient (central differences of active samples, one-sided at the end of the data; the
/// background is never read unless an end of the edge itself lies in it).
HermiteGrid sample_level_set(const BlockGrid& grid, RunContext& context);

/// What became of the crossing edges of sample_polygons().
struct PolygonSampling {
  std::size_t exact = 0;  ///< got the hit with a polygon
  std::size_t nearest =
      0;  ///< no polygon hits the edge, for a sample's sign is not the polygons'; the nearest one's plane
  std::size_t fallback = 0;  ///< nor is there one within a voxel that faces the right way; from the level set
  std::size_t ambiguous = 0;  ///< of the exact ones: several hits, so one was chosen
};

/// From polygons: where a crossing edge of the level set hits a polygon, the exact hit and the polygon's
/// normal, turned towards the outside. Where none does, the plane of the polygon nearest to the level set's
/// crossing. Of several hits the one taken passes from inside to outside as the signs of the edge's ends say
/// and lies nearest to the level set's own crossing; equal ones go to the lowest triangle number. So the
/// result does not depend on the order of the work.
HermiteGrid sample_polygons(const BlockGrid& grid, const PolygonMesh& mesh, RunContext& context,
                            PolygonSampling* sampling = nullptr);

}  // namespace hermesh
