// Distances from one surface to another, by samples.
#pragma once

#include "validation/geometry/triangle_soup.h"
#include "validation/geometry/triangle_tree.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

/// One-sided distances from the surface `from` to the surface `to`: the maximum over all points that `from`
/// uses and over `samples` points spread over its area, mean and rms over the latter alone, so that they are
/// means over the surface. A mesh of no area has its points as samples. The maximum is a lower bound of the
/// true one; hausdorff.h brackets it. @throws Cancelled.
Distances sampled_distances(const TriangleSoup& from, const TriangleTree& to, std::int64_t samples,
                            RunContext& context);

/// A point that stands for a part of a surface or of its edges, with the size of that part.
struct WeightedPoint {
  Eigen::Vector3d point;
  double weight;
};
/// Distances from a list of points to the surface `to`; mean and rms are weighted. An empty list gives zeros.
/// @throws Cancelled.
Distances point_distances(const std::vector<WeightedPoint>& points, const TriangleTree& to,
                          RunContext& context);

}  // namespace hermesh::validation
