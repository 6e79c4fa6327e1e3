// Meshes for the tests of validation, small enough to count by hand.
#pragma once

#include "algorithms/io/mesh_file.h"

namespace hermesh::validation::test {

/// The unit cube [0,1]³ scaled and moved, as six quads or as twelve triangles, oriented outwards. Corner
/// (x,y,z) of the unit cube is point x + 2y + 4z; the polygons come in the order −x +x −y +y −z +z.
MeshFile cube_of_quads(const Eigen::Vector3d& lower = Eigen::Vector3d::Zero(), double side = 1.0);
MeshFile cube_of_triangles(const Eigen::Vector3d& lower = Eigen::Vector3d::Zero(), double side = 1.0);

/// A torus of quads with the radii 1 and 0.25.
MeshFile torus(int around, int across);

/// A prism over a regular polygon of `sides` corners on the unit circle, from z = 0 to 2: quads round about,
/// fans of triangles at both ends.
MeshFile prism(int sides);

/// A profile, counter-clockwise and convex, swept from z = 0 to `depth`, in quads, with fans at both ends.
MeshFile extrusion(const std::vector<Eigen::Vector2d>& profile, double depth);

/// Returns the mesh with all polygons reversed.
MeshFile reversed(MeshFile mesh);

/// Two meshes as one, each with points of its own.
MeshFile together(MeshFile a, const MeshFile& b);

/// The mesh with equal points made one.
MeshFile welded(const MeshFile& mesh);

/// The mesh as triangles, quads cut into abc and acd, each with three points of its own.
MeshFile soup_of_triangles(const MeshFile& mesh);

}  // namespace hermesh::validation::test
