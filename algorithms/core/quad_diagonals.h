// Along which diagonal a quad of a file is cut. A mesh of ours says so by the order of its corners; a file's
// order means nothing.
#pragma once

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// Turns the corners of quads, and the attributes of those corners with them, so that each is cut along the
/// better diagonal:
///
/// 1. one on both sides of which the quad faces the same way as a whole, which in a concave quad is the
///    diagonal inside it;
/// 2. if that leaves both or none: the one across which the surface bends less;
/// 3. if they bend alike, as in a plane: the shorter one;
/// 4. if they are equally long: the one with the lowest point number of the four, so that it does not matter
///    at which corner the file starts.
void choose_diagonals(PolygonMesh& mesh);

}  // namespace hermesh
