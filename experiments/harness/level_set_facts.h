// What a row says of a level set besides what OpenVDB counts itself.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "algorithms/core/level_set.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "validation/mesh_report.h"

namespace hermesh {

/// FNV-1a over the background, the tiles, and of every leaf the origin, the mask of active voxels and the
/// bits of all values.
std::uint64_t fingerprint(const LevelSet& level_set);

/// The voxels along each axis, "12 × 34 × 56".
std::string dimensions_of(const LevelSet& level_set);

/// Connected components of the zero set, polygonised by marching cubes; 0 where it is empty.
std::int64_t count_surface_components(const LevelSet& level_set, RunContext& context);

/// The solid within the zero set, polygonised by marching cubes, beside that of the polygons it was made
/// from; nothing where it is empty.
std::optional<validation::SolidComparison> compare_surface(const LevelSet& level_set,
                                                           const PolygonMesh& source, RunContext& context);

}  // namespace hermesh
