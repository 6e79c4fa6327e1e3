#include "algorithms/extraction/manifold_dual_contouring/cube_mesh.h"

#include <algorithm>

namespace hermesh {

CubeMesh::CubeMesh(const DecimatedMesh& mesh, const DecimationCube& cube, std::span<const std::uint32_t> numbers)
    : triangles(numbers) {
  std::vector<std::uint32_t> ids;
  ids.reserve(3 * triangles.size());
  for (const std::uint32_t t : triangles) ids.insert(ids.end(), mesh.triangles[t].begin(), mesh.triangles[t].end());
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  vertices.resize(ids.size());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    Vertex& vertex = vertices[i];
    vertex.global = ids[i];
    vertex.point = mesh.points[ids[i]];
    vertex.here = vertex.free = cube.holds(vertex.point);
  }
  faces.resize(triangles.size());
  next_corner.resize(3 * triangles.size());
  double widths = 0;
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    Face& face = faces[f];
    face.global = triangles[f];
    face.own = true;
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t v = face.corners[i] = find_vertex(mesh.triangles[face.global][i]);
      face.box.add(vertices[v].point);
      face.own = face.own && vertices[v].here;
      next_corner[3 * f + i] = vertices[v].first_corner;
      vertices[v].first_corner = 3 * f + static_cast<std::uint32_t>(i);
    }
    for (const std::uint32_t v : face.corners) vertices[v].free = vertices[v].free && face.own;
    widths += (face.box.upper - face.box.lower).maxCoeff();
  }
  grid.emplace(std::max(1e-3, 1.5 * widths / double(faces.size())), faces.size());
  for (std::uint32_t f = 0; f < faces.size(); ++f) grid->add(f, faces[f].box);
}

std::uint32_t CubeMesh::find_face(std::uint32_t triangle) const {
  const auto at = std::lower_bound(triangles.begin(), triangles.end(), triangle);
  return at != triangles.end() && *at == triangle ? static_cast<std::uint32_t>(at - triangles.begin()) : kNone;
}

std::uint32_t CubeMesh::find_vertex(std::uint32_t point) const {
  const auto at = std::lower_bound(vertices.begin(), vertices.end(), point,
                                   [](const Vertex& vertex, std::uint32_t id) { return vertex.global < id; });
  return at != vertices.end() && at->global == point ? static_cast<std::uint32_t>(at - vertices.begin()) : kNone;
}

void CubeMesh::merge_corners(std::uint32_t going, std::uint32_t staying) {
  std::uint32_t kept = kNone;
  for (const std::uint32_t first : {vertices[going].first_corner, vertices[staying].first_corner})
    for (std::uint32_t corner = first, next; corner != kNone; corner = next) {
      next = next_corner[corner];
      if (faces[corner / 3].gone()) continue;
      next_corner[corner] = kept;
      kept = corner;
    }
  vertices[staying].first_corner = kept;
}

}  // namespace hermesh
