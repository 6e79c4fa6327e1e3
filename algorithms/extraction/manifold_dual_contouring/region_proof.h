// Cubes whose polygons do not keep the promises are split, until all that are left do.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "algorithms/core/run_context.h"
#include "algorithms/extraction/manifold_dual_contouring/edge_polygons.h"
#include "algorithms/extraction/manifold_dual_contouring/regions.h"

namespace hermesh {

/// Of a merged mesh T beside the uniform mesh S, whose cells' points lie within their cells.
///
/// **Topology.** The cells of a cube are a disc of S (regions.h), which T shrinks to a point. That keeps the
/// surface as it is if any two regions beside one another have one piece of border in common: if the border
/// of the common part of their faces is crossed twice (and never not at all, see regions.h). Then each edge
/// of T has two polygons, and as the border of a disc is one circle, so are the polygons around its point.
///
/// **No two polygons of T meet.** A region's point lies within its cube, so it sees each point of the cube's
/// faces once. The common part of two regions' faces is cut into triangles from a point within it to the
/// edges of its border: from where the segment between the regions' points passes through it, or from one
/// that the polygons are held to. Each of these triangles makes two tetrahedra with the regions' points.
/// Those of one edge are its envelope; envelopes lie side by side, and a polygon stays within its own, by the
/// choice of its diagonal or as a fan (region_polygon.h, after Ju & Udeshi 2006). Polygons of cells of
/// several sheets, or with ambiguous faces, are those of S, and too far from every cube to meet what has
/// changed (kAway in regions.cpp).
///
/// **Distance.** See region_shell.h.
///
/// @param tolerance by point, those on fanned edges included; voxels
/// @returns how many cubes were split
/// @throws Cancelled
std::size_t prove_regions(Regions& regions, const EdgePolygons& polygons,
                          const std::vector<Eigen::Vector3d>& points, std::span<const float> tolerance,
                          RunContext& context);

}  // namespace hermesh
