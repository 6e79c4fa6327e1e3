// The diagonals along which quads of a file are divided: in a file, the order of the corners has no meaning.
#pragma once

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// Rotates the corners of quads, and the attributes of those corners, so that each is divided along the
/// better diagonal:
///
/// 1. one on both sides of which the quad faces as a whole, which in a concave quad is the diagonal inside
///    it;
/// 2. if that leaves both or none: the one across which the surface bends less;
/// 3. if they bend alike, as in a plane: the shorter one;
/// 4. if they are equally long: the one with the lowest point number of the four, so that the first corner in
///    the file does not matter.
void choose_diagonals(PolygonMesh& mesh);

}  // namespace hermesh
