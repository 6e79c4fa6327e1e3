// Faces that a mesh has more than once, which would count more than once in its winding numbers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// Whether two of a face's points are one.
inline bool is_degenerate(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

/// Faces with the same three points as others, by number.
struct DuplicateFaces {
  /// Faces that others stand for.
  std::vector<std::uint32_t> dropped;
  /// Faces that were left of groups with as many faces of one winding as of the other.
  std::vector<std::uint32_t> cancelling;
};

/// Finds the faces to drop where several have the same three points: all but the first that has the winding
/// of most. Degenerate faces stay as they are.
DuplicateFaces find_duplicates(std::span<const Triangle> triangles);

/// Finds the cancelling faces that are double walls and bound nothing: where two parts of a model lie face on
/// face, and sheets of no thickness. Others are single faces of a surface that the file has twice, wound at
/// random. The faces around tell, since a surface goes on across its edges: connected cancelling faces are a
/// wall if without them fewer edges are left with an odd number of faces.
std::vector<std::uint32_t> find_double_walls(std::span<const Triangle> triangles,
                                             const DuplicateFaces& duplicates);

}  // namespace hermesh
