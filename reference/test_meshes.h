// Small meshes with known geometry, and mesh checks for the tests of this directory.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "algorithms/core/variant.h"

namespace hermesh::test {

/// Returns a sphere about a centre: a subdivided octahedron of 8·4^levels triangles with its points on the
/// sphere.
PolygonMesh sphere(double radius, int levels, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero());
/// Returns a cube of six quads with edge length 2·half, rotated by 20°, 30° and 40° about x, y and z.
PolygonMesh turned_cube(double half);
/// Returns the rotation of turned_cube().
Eigen::Matrix3d turn();
/// Returns a torus of 2·rings·sides triangles about the z axis.
PolygonMesh torus(double major, double minor, int rings, int sides);
/// Returns two meshes as one; the second one's points are converted to the first one's origin.
PolygonMesh joined(const PolygonMesh& first, const PolygonMesh& second);
/// Returns the mesh with all polygons reversed.
PolygonMesh reversed(PolygonMesh mesh);

double signed_volume(const PolygonMesh& mesh);
/// Returns true if every directed edge occurs exactly once, and its opposite exactly once: then the mesh is
/// closed, edge-manifold and oriented.
bool closed_and_oriented(const PolygonMesh& mesh);
/// Returns the number of points that polygons use, minus that of edges, plus that of triangles.
long euler_characteristic(const PolygonMesh& mesh);

PolygonMesh extract(const std::string& extractor, const LevelSet& level_set,
                    const std::map<std::string, std::string>& options = {}, double isovalue = 0.0);
LevelSet voxelize(const std::string& voxelizer, const PolygonMesh& mesh, double voxel_size,
                  double exterior = 3.0, double interior = 3.0);

}  // namespace hermesh::test
