// Faces that agree on which side is out, by CGAL's orientation of polygon soups: for the oracle of signs on
// models whose faces do not, where a winding number counts the faces that are the wrong way round, too.
#pragma once

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// The mesh's triangles, those turned over that run along an edge of two faces in the same direction as their
/// neighbour, so that a patch keeps the winding of the larger part of its area. Points and the order of the
/// triangles stay. Points with the same coordinates are one.
PolygonMesh with_agreeing_faces(const PolygonMesh& mesh);

}  // namespace hermesh
