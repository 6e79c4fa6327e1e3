// The order of triangles along a Hilbert curve.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// Numbers of the triangles in the order in which a Hilbert curve through the bounding cube, 1024 cells a
/// side, meets the centers of their boxes. Crowded cells are ordered by a curve of their own, and so on;
/// triangles with the same center are ordered by number. The result is the same for every number of threads.
std::vector<std::uint32_t> hilbert_order(std::span<const Eigen::Vector3f> points,
                                         std::span<const Triangle> triangles);

}  // namespace hermesh
