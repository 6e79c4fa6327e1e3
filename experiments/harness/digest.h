// Digests of what a program made: equal digits mean equal bytes, so that two commits, two numbers of threads
// or two levels of vector code can be compared without keeping what they made. 16 hexadecimal digits of a
// SHA-256.
#pragma once

#include <openvdb/Grid.h>

#include <string>
#include <string_view>
#include <vector>

#include "algorithms/core/level_set.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/hermite/sparse_hermite.h"

namespace hermesh {

std::string digest_of_text(std::string_view text);

/// The origin, the arrays and the attributes in their order.
std::string digest(const PolygonMesh& mesh);

/// Several meshes in their order, such as the pieces of a fracture.
std::string digest(const std::vector<PolygonMesh>& meshes);

/// The placement, the background, the tiles, and of every leaf the origin, the mask of active voxels and the
/// bits of all values (fingerprint() of level_set_facts.h).
std::string digest(const LevelSet& level_set);

/// A grid of any type: its placement, its topology and its values.
std::string digest(const openvdb::GridBase& grid);

/// The placement, the signs and the crossings.
std::string digest(const FloatHermite& hermite);

}  // namespace hermesh
