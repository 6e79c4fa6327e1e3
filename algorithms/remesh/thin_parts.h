// Parts of polygons that a level set cannot show: walls, wires and bodies thinner than its samples, and open
// surfaces, which bound nothing. They are found by comparison with the surface of the level set, and
// preserved by a shell around the polygons that is as thin as the samples allow.
#pragma once

#include <optional>
#include <string>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/hermite/solids.h"

namespace hermesh {

/// Treatment of parts that are thinner than the samples can show.
enum class ThinRule {
  keep,   ///< they are thickened until they show
  drop,   ///< they are lost
  refuse  ///< they are an error
};

/// Statistics of thickened parts; world units.
struct ThinParts {
  double area = 0.0;            ///< of the polygons
  double thickened_area = 0.0;  ///< of the polygons with a shell
  double thickest = 0.0;        ///< largest increase of a wall's thickness
  double merged_area = 0.0;     ///< of polygons on both sides of filled gaps
  double thinnest_wall = 0.0;   ///< of the thickened walls; 0: only open surfaces were thickened
  bool has_open = false;        ///< true if polygons that bound nothing were thickened
};

/// A solid sampled from polygons.
struct PolygonSolid {
  SampledSolid solid;
  std::optional<ThinParts> thin;  ///< none if no part was thickened
};

/// Returns the solid of polygons with its exact Hermite data. With ThinRule::keep it is the union of the
/// solid that the level set shows and a shell around those of the polygons that it does not show within half
/// a voxel, or that have holes narrower than a voxel. Polygons within the solid do not count. Walls and open
/// surfaces become at most 1.2 voxels thick where they are thinner, wires and specks 1.75; gaps that are
/// thinner than a voxel and do not show are filled. Where the level set shows all polygons, the solid is the
/// same as with ThinRule::drop. The bytes are the same for every number of threads.
/// @param level_set with samples at multiples of the voxel size from the mesh's origin; unsigned distances,
///   of polygons that enclose nothing, represent an empty solid unless the rule is to drop
/// @throws Error if the rule is to refuse and a part is lost; as sample_polygons(); Cancelled
PolygonSolid solid_of(const PolygonMesh& mesh, const LevelSet& level_set, ThinRule rule, RunContext& context);

/// Returns a note on the thickened and filled parts, and how to avoid them. @param voxel_size world units
std::string thin_note(const ThinParts& thin, double voxel_size);

}  // namespace hermesh
