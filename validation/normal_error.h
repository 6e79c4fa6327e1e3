// How far the polygons of a surface lean from those of another, by samples.
#pragma once

#include "validation/geometry/triangle_soup.h"
#include "validation/geometry/triangle_tree.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

/// The angle between the normals of `from` at `samples` points spread over its area and those of `to` at the
/// points nearest to them, each normal that of the triangle as it is wound. Triangles without area are left
/// out. Next to a crease of `to` a point may be nearest to the other side of it; such samples belong to the
/// error. @throws Cancelled.
NormalAngles sampled_normal_angles(const TriangleSoup& from, const TriangleTree& to, std::int64_t samples,
                                   RunContext& context);

}  // namespace hermesh::validation
