// Components and genus of a surface.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// Returns by point the least number of a point at the same position. O(n log n) time.
std::vector<std::uint32_t> first_at_position(std::span<const Eigen::Vector3f> points);

struct Topology {
  std::size_t components = 0;         ///< sets of triangles connected by vertices
  std::optional<std::int64_t> genus;  ///< sum over the components; none if an edge has not two triangles
};

/// Returns the topology of triangles. Points at equal positions count as one, and triangles with two of these
/// do not count. O(n log n) time.
Topology topology_of(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles);

}  // namespace hermesh
