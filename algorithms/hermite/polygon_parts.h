// The exact crossings of polygons for a part of their lattice.
#pragma once

#include "algorithms/hermite/samplers.h"

namespace hermesh {

/// Replaces the crossings of a level set by those of polygons as sample_polygons() does, for a part of them:
/// the triangles near the crossings suffice. @param inside_out as are_inside_out() returns for all polygons
void take_polygons(FloatHermite& hermite, const PolygonMesh& mesh, bool inside_out, RunContext& context,
                   PolygonSampling* sampling);
/// Returns true if polygons are wound inside out: their volume is negative, for any point of an open mesh's
/// box as the apex.
bool are_inside_out(const PolygonMesh& mesh, const IndexToWorld& placement);

}  // namespace hermesh
