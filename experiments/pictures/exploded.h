// A picture of the pieces of a fracture, moved apart, and the choice of a view.
#pragma once

#include "experiments/pictures/render.h"

namespace hermesh {

/// Writes exploded.png into a directory with pieces.json and the files of the pieces (fracture_folder.h):
/// each piece is moved away from the middle of the object by half of its distance from it.
/// @throws Error if a file cannot be read or written; Cancelled.
void draw_exploded(const std::filesystem::path& directory, RunContext& context);

/// Returns the viewpoint with the largest visible area of the surface, out of 12 azimuths and elevations of
/// 10, 25 and 45 degrees; the first in the order of elevation and azimuth if equal. It is the area of the
/// surface, not of its projection, but angles below 14 degrees count as 14. The default for an empty mesh.
/// @throws Cancelled.
Viewpoint open_viewpoint(const PolygonMesh& mesh, RunContext& context);

/// Returns a close-up of `size` (CloseUp::size) about the visible point around which the surface turns most:
/// the square with the greatest sum of angles between normals of neighbouring pixels, and background on at
/// most a tenth of it. The middle of the box if there is none. @throws Cancelled.
CloseUp busy_close_up(const PolygonMesh& mesh, const Bounds& frame, const Viewpoint& viewpoint, double size,
                      RunContext& context);

}  // namespace hermesh
