// Where to look at an object from, where nobody says so.
#pragma once

#include "experiments/pictures/render.h"

namespace hermesh {

/// The viewpoint from which the most surface is seen, out of 12 azimuths and elevations of 10, 25 and 45
/// degrees. What counts is the area of the surface and not of its picture, but a part seen at a grazing angle
/// of below 14 degrees counts as one at 14; what lies behind other parts counts for nothing. Equal ones: the
/// first in the order of elevation, then of azimuth. The default one for an empty mesh. @throws Cancelled.
Viewpoint open_viewpoint(const PolygonMesh& mesh, RunContext& context);

/// A close-up of `size` (CloseUp::size) about the place that is seen from the viewpoint and about which the
/// surface turns most: the square that has the greatest sum of angles between normals of neighbouring pixels,
/// and shows background on at most a tenth of it. Where no square does, the middle of the box. @throws
/// Cancelled.
CloseUp busy_close_up(const PolygonMesh& mesh, const Bounds& frame, const Viewpoint& viewpoint, double size,
                      RunContext& context);

}  // namespace hermesh
