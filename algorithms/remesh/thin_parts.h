// Parts of polygons that a level set cannot show: walls, wires and bodies thinner than its samples, and open
// sheets, which bound nothing. They are found by comparison with the surface that the level set stands for,
// and are kept as a shell around the polygons that is as thin as the samples allow.
#pragma once

#include <optional>
#include <string>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/hermite/solids.h"

namespace hermesh {

/// What becomes of parts that are thinner than the samples can show.
enum class ThinRule {
  keep,   ///< they are thickened until they show
  drop,   ///< they are lost
  refuse  ///< they are an error
};

/// What was done about parts that the samples cannot show.
struct ThinParts {
  double area = 0.0;            ///< of the polygons, world units²
  double thickened_area = 0.0;  ///< of the polygons around which there is a shell, world units²
  double thickest = 0.0;        ///< the most that a wall became thicker, world units
  double merged_area = 0.0;     ///< of polygons on both sides of gaps that were filled, world units²
  double thinnest_wall = 0.0;   ///< of the walls that were thickened, world units; 0: only sheets were
  bool has_sheets = false;      ///< true if polygons that bound nothing were thickened
};

/// A solid sampled from polygons.
struct PolygonSolid {
  SampledSolid solid;
  std::optional<ThinParts> thin;  ///< none if no part was thickened
};

/// Returns the solid of polygons with its exact Hermite data. With ThinRule::keep it is the union of the
/// solid that the level set shows and a shell around those of the polygons that it does not show within half
/// a voxel, or that have holes narrower than a voxel. Polygons within the solid do not count. Walls and
/// sheets become at most 1.2 voxels thick where they are thinner, wires and specks 1.75; gaps that are
/// thinner than a voxel and do not show are filled. Where the level set shows all polygons, the solid is the
/// same as with ThinRule::drop. The bytes are the same for every number of threads.
/// @param level_set with samples at multiples of the voxel size from the mesh's origin; distances without
/// sign, of
///   polygons that enclose nothing, stand for an empty solid unless the rule is to drop
/// @throws Error if the rule is to refuse and a part is lost; as sample_polygons(); Cancelled
PolygonSolid solid_of(const PolygonMesh& mesh, const LevelSet& level_set, ThinRule rule, RunContext& context);

/// A sentence on what was thickened and filled, and what to do to avoid it. @param voxel_size world units
std::string thin_note(const ThinParts& thin, double voxel_size);

}  // namespace hermesh
