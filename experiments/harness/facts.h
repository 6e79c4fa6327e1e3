// Facts about level sets, meshes and Hermite data in rows: digests, dimensions, components, the solid.
#pragma once

#include <openvdb/Grid.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "algorithms/core/level_set.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/hermite/sparse_hermite.h"
#include "validation/mesh_report.h"

namespace hermesh {

// Digests: the first 16 hexadecimal digits of a SHA-256. Equal digests mean equal bytes, so that commits,
// numbers of threads or SIMD levels can be compared without storing the outputs.

std::string digest_of_text(std::string_view text);
/// Covers the origin, the arrays and the attributes in their order.
std::string digest(const PolygonMesh& mesh);
std::string digest(const std::vector<PolygonMesh>& meshes);
/// Covers the placement and the fingerprint.
std::string digest(const LevelSet& level_set);
/// Covers the placement, the name, the topology and the values of a grid of any type.
std::string digest(const openvdb::GridBase& grid);
/// Covers the placement, the signs and the crossings.
std::string digest(const FloatHermite& hermite);

/// Returns FNV-1a over the background, the tiles, and of every leaf the origin, the mask of active voxels and
/// the bits of all values.
std::uint64_t fingerprint(const LevelSet& level_set);

/// Returns the voxels along each axis, "12 × 34 × 56".
std::string dimensions_of(const LevelSet& level_set);

/// Returns the connected components of the zero set, polygonised by marching cubes; 0 if it is empty.
std::int64_t count_surface_components(const LevelSet& level_set, RunContext& context);

/// Compares the solid within the zero set, polygonised by marching cubes, with that of the source polygons;
/// none if it is empty.
std::optional<validation::SolidComparison> compare_surface(const LevelSet& level_set,
                                                           const PolygonMesh& source, RunContext& context);

}  // namespace hermesh
