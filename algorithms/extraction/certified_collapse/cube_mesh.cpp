#include "algorithms/extraction/certified_collapse/cube_mesh.h"

namespace hermesh {

CubeMesh::CubeMesh(const DecimatedMesh& mesh, const DecimationCube& cube,
                   std::span<const std::uint32_t> triangles, CubeNumbers& numbers) {
  numbers.vertex.resize(mesh.points.size(), kNone);
  vertices.reserve(triangles.size() / 2 + 64);
  faces.resize(triangles.size());
  next_corner.resize(3 * triangles.size());
  // In the order of the triangles, so local numbers do not depend on what the thread did before.
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    Face& face = faces[f];
    face.global = triangles[f];
    face.own = true;
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t point = mesh.triangles[face.global][i];
      std::uint32_t v = numbers.vertex[point];
      // An entry of another cube names no vertex here, or one of another point.
      if (v >= vertices.size() || vertices[v].global != point) {
        v = numbers.vertex[point] = static_cast<std::uint32_t>(vertices.size());
        const bool here = cube.holds(mesh.points[point]);
        vertices.push_back({.point = mesh.points[point],
                            .global = point,
                            .here = here,
                            .free = here && !mesh.pinned[point]});
      }
      face.corners[i] = v;
      face.own = face.own && vertices[v].here;
      next_corner[3 * f + i] = vertices[v].first_corner;
      vertices[v].first_corner = 3 * f + static_cast<std::uint32_t>(i);
    }
    // All triangles of a point in the cube are listed, for they touch it. The point may move if all of them
    // lie in it: no other cube sees any of them then.
    if (!face.own)
      for (const std::uint32_t v : face.corners) vertices[v].free = false;
  }
}

void CubeMesh::merge_corners(std::uint32_t going, std::uint32_t staying) {
  // Both lists become one, without corners of faces that are gone.
  std::uint32_t kept = kNone;
  for (const std::uint32_t first : {vertices[going].first_corner, vertices[staying].first_corner})
    for (std::uint32_t corner = first, next; corner != kNone; corner = next) {
      next = next_corner[corner];
      if (faces[corner / 3].gone) continue;
      next_corner[corner] = kept;
      kept = corner;
    }
  vertices[staying].first_corner = kept;
}

}  // namespace hermesh
