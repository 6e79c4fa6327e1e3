// Meshes for the tests of validation, small enough to count by hand.
#pragma once

#include "algorithms/io/mesh_file.h"

namespace hermesh::validation::test {

/// Returns the unit cube [0,1]³ scaled and translated, as six quads or as twelve triangles, oriented
/// outwards. Corner (x,y,z) of the unit cube is vertex x + 2y + 4z; the polygons are in the order −x +x −y +y
/// −z +z.
MeshFile cube_of_quads(const Eigen::Vector3d& lower = Eigen::Vector3d::Zero(), double side = 1.0);
MeshFile cube_of_triangles(const Eigen::Vector3d& lower = Eigen::Vector3d::Zero(), double side = 1.0);

/// Returns a torus of around × across quads with the radii 1 and 0.25.
MeshFile torus(int around, int across);

/// Returns a prism over a regular polygon of `sides` corners on the unit circle, from z = 0 to 2: quads on
/// the sides, triangle fans at both ends.
MeshFile prism(int sides);

/// Returns a counter-clockwise convex profile extruded from z = 0 to `depth`: quads on the sides, triangle
/// fans at both ends.
MeshFile extrusion(const std::vector<Eigen::Vector2d>& profile, double depth);

/// Returns the mesh with all polygons reversed.
MeshFile reversed(MeshFile mesh);

/// Returns both meshes as one, without shared vertices.
MeshFile together(MeshFile a, const MeshFile& b);

/// Returns the mesh with vertices at equal positions merged.
MeshFile welded(const MeshFile& mesh);

/// Returns the mesh as triangles, each with three vertices of its own; a quad abcd is split into abc and acd.
MeshFile soup_of_triangles(const MeshFile& mesh);

}  // namespace hermesh::validation::test
