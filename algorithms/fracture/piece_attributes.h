// Texture coordinates of the cut polygons of a piece.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// A function that gives the normal of the plane between a piece and its neighbour of that number, or
/// nothing, as Cutters::plane_between() does.
using PlaneOfNeighbour = std::function<std::optional<Eigen::Vector3d>(std::int32_t neighbour)>;

/// Adds the corner attribute "uv": for cut polygons (attribute `surface`) the coordinates, in world units
/// relative to the mesh's origin, along two axes at right angles in the plane between the two pieces, so that
/// textures are not stretched; where there is no such plane, the two coordinates other than the one along
/// which the triangle's normal is greatest. The coordinates depend only on positions and on the cutters of
/// the two pieces, so both sides of a seam have the same coordinates, and those of a vertex do not change
/// with the resolution. Original polygons get (0, 0). @throws Error if the piece lacks the attributes
/// `surface` and `neighbour` of piece_mesh().
void add_cut_uv(PolygonMesh& piece, const PlaneOfNeighbour& plane);

}  // namespace hermesh
