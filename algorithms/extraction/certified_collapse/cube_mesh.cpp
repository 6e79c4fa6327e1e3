#include "algorithms/extraction/certified_collapse/cube_mesh.h"

namespace hermesh {

CubeMesh::CubeMesh(const DecimatedMesh& mesh, const DecimationCube& cube, std::span<const std::uint32_t> triangles,
                   CubeNumbers& numbers) {
  numbers.vertex.resize(mesh.points.size(), kNone);
  vertices.reserve(triangles.size() / 2 + 64);
  faces.resize(triangles.size());
  next_corner.resize(3 * triangles.size());
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    Face& face = faces[f];
    face.global = triangles[f];
    face.own = true;
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t point = mesh.triangles[face.global][i];
      std::uint32_t v = numbers.vertex[point];
      if (v >= vertices.size() || vertices[v].global != point) {
        v = numbers.vertex[point] = static_cast<std::uint32_t>(vertices.size());
        const bool here = cube.holds(mesh.points[point]);
        vertices.push_back({.point = mesh.points[point], .global = point, .here = here, .free = here && !mesh.pinned[point]});
      }
      face.corners[i] = v;
      face.own = face.own && vertices[v].here;
      next_corner[3 * f + i] = vertices[v].first_corner;
      vertices[v].first_corner = 3 * f + static_cast<std::uint32_t>(i);
    }
    if (!face.own)
      for (const std::uint32_t v : face.corners) vertices[v].free = false;
  }
}

void CubeMesh::merge_corners(std::uint32_t going, std::uint32_t staying) {
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
