// Meshes for the tests of the judges, small enough to count by hand.
#pragma once

#include "algorithms/io/mesh_file.h"

namespace hermesh::validation::test {

/// [0,1]³ scaled and moved, as six quads or as twelve triangles, oriented outwards. Corner (x,y,z) of the
/// unit cube is point x + 2y + 4z; the polygons come in the order −x +x −y +y −z +z.
MeshFile cube_of_quads(const Eigen::Vector3d& lower = Eigen::Vector3d::Zero(), double side = 1.0);
MeshFile cube_of_triangles(const Eigen::Vector3d& lower = Eigen::Vector3d::Zero(), double side = 1.0);

/// Quads; radii 1 and 0.25.
MeshFile torus(int around, int across);

/// Unit circle of `sides` corners from z = 0 to 2: quads round about, fans of triangles at both ends.
MeshFile prism(int sides);

/// The profile, counter-clockwise and convex, swept from z = 0 to `depth`, in quads, with fans at both ends.
MeshFile extrusion(const std::vector<Eigen::Vector2d>& profile, double depth);

/// Both, with points of their own.
MeshFile together(MeshFile a, const MeshFile& b);

/// The same surface with points shared where they are equal.
MeshFile welded(const MeshFile& mesh);

/// Quads cut into abc and acd, each triangle with three points of its own.
MeshFile soup_of_triangles(const MeshFile& mesh);

}  // namespace hermesh::validation::test
