// Components and genus of a surface.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

struct Topology {
  std::size_t components = 0;         ///< sets of triangles connected by vertices
  std::optional<std::int64_t> genus;  ///< sum over the components; none if an edge has not two triangles
};

/// Returns the topology of triangles. Points at equal positions count as one, and triangles with two of these
/// do not count. O(n log n) time.
Topology topology_of(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles);

}  // namespace hermesh
