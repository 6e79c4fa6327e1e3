// Sharp features of a reference surface, and their distances to a mesh.
#pragma once

#include <vector>

#include "validation/geometry/triangle_soup.h"
#include "validation/geometry/triangle_tree.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

struct SharpFeatures {
  std::vector<std::array<Eigen::Vector3d, 2>> edges;
  std::vector<Eigen::Vector3d> corners;
  std::int64_t edges_excluded = 0;
};

/// Returns the sharp edges and corners of a surface of triangles, after welding points whose three
/// coordinates are equal and removing triangles of no area. An edge is a candidate if exactly two triangles
/// meet in it and their normals differ by more than `dihedral_degrees` (the turning of the edge).
///
/// A candidate that turns by at most 50° may be part of a smooth blend, a rounded edge in coarse steps, whose
/// turning is spread over a row of parallel edges. Its neighbour in the row on one side is found by a walk
/// over the surface, at right angles to the edge, from a point near its middle, across all edges that turn by
/// less than a third of its own turning, to the first that does not. This edge is its neighbour if it turns
/// in the same sense (both convex or both concave), also by at most 50°, and is within 45° of parallel. The
/// candidate is excluded
///  - if it has a neighbour on both sides, and neither is more than three times as far away as the other; or
///  - if it ends such a row: one neighbour is excluded by the first rule and turns by at least nine tenths of
///    the candidate's turning.
/// The edges of a cube turn by too much and the two edges of a single chamfer have a neighbour on one side
/// only; both are kept. A walk ends without a neighbour at the boundary of the surface, and if it is as long
/// as the surface's diagonal or has crossed as many triangles as there are.
///
/// A corner is a point at which three or more sharp edges meet, or one at which two sharp edges meet whose
/// directions differ by more than `dihedral_degrees` from a straight line, and no excluded edge: where an
/// excluded edge ends, the turn belongs to the blend.
SharpFeatures find_sharp_features(const TriangleSoup& reference, double dihedral_degrees);

/// Returns distances from the sharp features of the reference to the mesh, in world units. Each edge is
/// sampled at the middles of equal pieces, at least four and none longer than 1/4000 of the reference's
/// diagonal; mean and rms are over the length of the edges. The maximum includes the ends of the edges.
FeatureDistances feature_distances(const TriangleSoup& reference, const TriangleTree& mesh,
                                   double dihedral_degrees, RunContext& context);

}  // namespace hermesh::validation
