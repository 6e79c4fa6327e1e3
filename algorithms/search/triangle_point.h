// The point of a triangle that is nearest to another point.
#pragma once

#include <Eigen/Core>

namespace hermesh {

/// A point of a triangle.
struct TrianglePoint {
  Eigen::Vector3d position;
  Eigen::Vector3d weights;  ///< barycentric coordinates: at least 0, their sum is 1
};

/// Returns the point of the triangle abc that is nearest to p. A degenerate triangle is treated as its edges,
/// or as a single point. Any unit, the same for all arguments.
TrianglePoint closest_point(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                            const Eigen::Vector3d& c);

}  // namespace hermesh
