// Faces that agree on which side is out, by CGAL's orientation of polygon soups: for the oracle of signs on
// models whose faces do not, where a winding number also counts the reversed faces.
#pragma once

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// Returns the mesh as triangles whose faces agree: where two triangles run along their common edge in the
/// same direction, one of them is reversed, so that a patch keeps the winding of the larger part of its area.
/// Points with the same coordinates count as one. The list of points and the order of the triangles stay as
/// they are.
PolygonMesh with_agreeing_faces(const PolygonMesh& mesh);

}  // namespace hermesh
